"""Kernels of pages that are copies of the builder: they begin as a new one would, and end with their page."""

from pathlib import Path

import pytest
from processes import ended, environment
from strategies import AT_NIGHT

DOCS = Path(__file__).parents[2] / "docs"

#: Executes pages of one cell each in copies, and prints what they print, or the name of what they raise.
PAGES = """
    import logging, multiprocessing, os, sys
    from pathlib import Path

    sys.path += [sys.argv[1], str(Path(sys.argv[1]).parent / "benchmarks")]
    from builder import kernels
    from nbclient import NotebookClient
    from nbclient.exceptions import CellExecutionError, DeadKernelError
    from nbformat.v4 import new_code_cell, new_notebook

    kernels.IMPORTED = ("ipykernel.kernelapp", "json.tool")  # the others take seconds
    kernels.use_copies()
    logging.captureWarnings(True)  # as Sphinx does
    logging.basicConfig(level=logging.INFO)
    mine = 1
    for source in sys.argv[3:]:
        page = new_notebook(cells=[new_code_cell(source)])
        try:
            NotebookClient(page, resources={"metadata": {"path": sys.argv[2]}}).execute()
            print(*("".join(each["text"]) for each in page.cells[0].outputs), sep="|", end="")
        except (CellExecutionError, DeadKernelError) as error:
            print(type(error).__name__)
    print("left:", multiprocessing.active_children(), os.getcwd() == sys.argv[2])
"""

SHOWN = """
import logging, os, sys, warnings
print(os.getcwd(), os.environ["PAGE"])
print([folder for folder in sys.path if folder.endswith(("docs", "benchmarks"))], "json.tool" in sys.modules)
print("mine" in globals(), __name__)
logging.getLogger("quiet").info("not seen")
warnings.warn("seen")
"""

#: Prints in two parts, half a second from each other.
SLOW = "import time; print('in one', end=''); time.sleep(0.5); print(' part')"


@pytest.mark.skipif(not AT_NIGHT, reason="three seconds: by night, and every build of the site begins pages so")
def test_a_page_begins_as_in_a_new_kernel_and_ends_with_its_kernel(site_tools, tmp_path):
    pages = (SHOWN, "unknown", "import os; os._exit(3)", "print('the next one')", SLOW)
    answer = ended(PAGES, DOCS, tmp_path, *pages, env=environment(PAGE="set"))
    assert answer.returncode == 0, answer.stderr
    here, paths, names, warned, *_, failed, dead, after, slow, left = answer.stdout.splitlines()
    assert here == f"{tmp_path} set"
    assert paths == "[] True"
    assert names == "False __main__"
    assert "UserWarning: seen" in warned
    assert "not seen" not in answer.stdout
    assert (failed, dead, after, slow) == ("CellExecutionError", "DeadKernelError", "the next one", "in one part")
    assert left == "left: [] False"
