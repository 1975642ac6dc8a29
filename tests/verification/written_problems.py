"""Problems to be written and read again: the built-in ones, and random ones with every key that a file may have."""

from fractions import Fraction as F

import strategies
from hypothesis import strategies as st

import verification as vf
from ndtheory.texts import clean
from verification.cli.problems import examples
from verification.registry import RULES

BUILT_IN = {name: vf.example(name) for name in examples()}
MESH = {"mesh": "body.msh", "young": 1, "poisson": "1/3", "fixed": ["under"]}

#: Any texts without characters of control, also with what TOML escapes.
texts = st.text(st.characters(exclude_categories=["Cs"]).filter(clean), max_size=12)

ratios = st.fractions(F(1, 10**6), 10**6)


@st.composite
def documents(draw, folder):
    """Dictionaries of all kinds of problems: those of the iteration, obstacles, mesh files, every rule."""
    data = draw(strategies.contact_problems())
    plane = data["dimension"] == 2
    kind = draw(st.sampled_from(["plain", "plain", "rigid", "mesh"] if plane else ["plain", "rigid"]))
    name = draw(st.sampled_from(["body1", "body2"]))
    if kind == "rigid":
        shown = draw(st.lists(st.sampled_from([k for k in ("x", "y") if k in data[name]]), unique=True))
        data[name] = {"shape": "rigid"} | {key: data[name][key] for key in shown}
    elif kind == "mesh":
        data[name] = {
            "mesh": draw(st.sampled_from([str(folder / f"{name}.msh"), f"{name}.msh"])),
            "young": data[name]["young"],
            "poisson": draw(st.fractions(F(-9, 10), F(4, 9), max_denominator=10**9)),
            "fixed": draw(st.lists(texts, max_size=2, unique=True)),
            "traction": {draw(texts.filter(lambda side: len(side) > 3)): ["1/3", 0]},
        }
        data[name]["fixed"] = [side for side in data[name]["fixed"] if side not in data[name]["traction"]]
    if draw(st.booleans()):
        data["title"] = draw(texts)
        data["units"] = {"length": draw(texts), "stress": draw(texts)}
    if draw(st.booleans()):
        data["norm"] = {"length": draw(ratios)}
        data["contact"] = data["contact"] | {"radius": draw(ratios), "gap": draw(ratios)}
    relaxation = draw(st.sampled_from(sorted(RULES)))
    data["iteration"] |= {"relaxation": relaxation, "tolerance": draw(st.floats(1e-30, 0.99))}
    if draw(st.booleans()):
        del data["iteration"]["theta"]
    elif draw(st.booleans()):
        data["iteration"]["theta"] = "auto"
    if draw(st.booleans()):
        data["iteration"]["max_iterations"] = draw(st.integers(1, 10**6))
    return data


def problems(meshes):
    return documents(meshes).map(lambda data: vf.Problem.from_dict(data, source=str(meshes / "problem.toml")))
