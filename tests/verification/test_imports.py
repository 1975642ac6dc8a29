"""What imports of ours do, in processes of their own: another test may have imported the same in this one."""

from processes import ended

#: Each module of ours is imported.  At every import on the way, and at the end, what lies in sys.modules under a name
#: that could be imported must be what would be imported: another thread may ask for it at that moment.
GENUINE = """
import importlib, pkgutil, sys
from importlib.machinery import PathFinder

stand_ins, seen = set(), set()

def look(event, arguments=()):
    if event != "import":
        return
    for name, module in reversed(list(sys.modules.items())):
        if (name, id(module)) in seen:
            break
        seen.add((name, id(module)))
        parent, _, last = name.rpartition(".")
        path = getattr(sys.modules.get(parent), "__path__", None) if parent else None
        if getattr(module, "__spec__", None) is None and (path or not parent) and PathFinder.find_spec(name, path):
            stand_ins.add(name)

look("import")
stand_ins.clear()  # what an interpreter starts with
sys.addaudithook(look)
for package in ("fem1d2d", "ndtheory", "verification"):
    package = importlib.import_module(package)
    for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        importlib.import_module(module.name)
look("import")
assert not stand_ins, stand_ins
import scipy.stats
assert sys.modules["scipy.stats"] is scipy.stats
assert scipy.stats.norm.cdf(0) == 0.5
"""


def test_no_import_of_ours_puts_a_substitute_where_other_threads_import():
    done = ended(GENUINE)
    assert done.returncode == 0, done.stderr


#: Python without hypothesis, which says how often it was asked for.
WITHOUT = """
import sys

class Missing:
    asked = 0

    def find_spec(self, name, path=None, target=None):
        if name == "hypothesis":
            Missing.asked += 1
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Missing())
import verification as vf

for name in vf.__all__:
    getattr(vf, name)
print(Missing.asked)
import verification.testing
"""


def test_nothing_but_the_kit_asks_for_hypothesis_and_it_says_what_to_install():
    done = ended(WITHOUT)
    assert (done.returncode, done.stdout.strip()) == (1, "0")
    assert "verification.testing needs hypothesis: pip install hypothesis" in done.stderr.splitlines()[-1]
