"""Modules that constants, bounds, runs and their comparison rest on, and tests of them."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[2]


FILES = sorted(ROOT.glob("tests/*/**/test_*.py"))


def _tests(names: str) -> tuple[str, ...]:
    """The files of tests by what they are about, in whichever folder they lie."""
    found = {name: [path for path in FILES if path.name == f"test_{name}.py"] for name in names.split()}
    if unclear := [name for name, paths in found.items() if len(paths) != 1]:
        raise ValueError(f"needed one file of tests for each of {', '.join(unclear)}")
    return tuple(paths[0].relative_to(ROOT).as_posix() for paths in found.values())


#: The files of tests that are about each module, the one most likely to notice a change first.
MISSION: dict[str, tuple[str, ...]] = {
    f"{module}.py": _tests(tests)
    for module, tests in {
        "fem1d2d/assembly": "assembly uncoupled polygons condense",
        "fem1d2d/condense": "flexibility condense uncoupled few_unknowns",
        "fem1d2d/element": "element strain assembly material",
        "fem1d2d/line": "line whole_sides obstacles lines",
        "fem1d2d/mesh": "mesh overlap supports outline crossed_cells",
        "fem1d2d/pencil": "bars refinement pencil",
        "fem1d2d/places": "places values",
        "fem1d2d/supports": "supports refinement",
        "fem1d2d/trace": "transfer trace",
        "ndtheory/bounds": "bounds_hypotheses bounds enclosures",
        "ndtheory/constants": "bounds_hypotheses energy_hypotheses enclosures",
        "ndtheory/energy_norms": "energy_safe energy_norms energy_hypotheses waves",
        "ndtheory/number": "number enclosures",
        "verification/algorithm/affine_piece": "jacobian margin",
        "verification/algorithm/arrival": "arrival iteration",
        "verification/algorithm/fixed_point": "lean_step iteration relaxation jacobian",
        "verification/algorithm/loop": "arrival iteration",
        "verification/algorithm/linearisation": "jacobian prediction margin",
        "verification/algorithm/rates": "rates_safe rates",
        "verification/algorithm/relaxation": "relaxation conformance",
        "verification/algorithm/runs": "iteration results held_by_contact global relaxation checks",
        "verification/semidefinite/conditions": "multipliers_safe lifted exact rounding certificate_tree",
        "verification/semidefinite/interior_point": "interior_point exact multipliers",
        "verification/semidefinite/lipschitz": "mirror exact lifted verified_comparison",
        "verification/semidefinite/multipliers": "multipliers_safe multipliers exact verdicts",
        "verification/semidefinite/trace_forms": "rounding_of_forms rounding_of_forms_in_friction compare_bounds",
        "verification/comparison": "compare_bounds verdicts first_numbers",
        "verification/constants/measuring": "constants energy_constants measured_ends operators",
        "verification/constants/operators": "operators",
        "verification/contact/active_set": "rigid_motion contact lean_step",
        "verification/contact/kkt": "kkt contact",
        "verification/contact/step": "rigid_motion contact held_by_contact",
        "verification/contact/system": "global few_unknowns lines history",
        "verification/interface/body": "response few_unknowns constants cattaneo materials held_by_contact",
        "verification/interface/friction": "warnings build grids",
        "verification/interface/interface": "build grids conformance symmetry lines varying_friction jacobian",
        "verification/interface/joining": "joining whole_sides obstacles drawn_geometry lines drawn_bodies",
        "verification/interface/pair": "build relaxation constants global varying_friction obstacles",
        "verification/interface/values": "values",
        "verification/algorithm/monolithic": "global checks drawn_geometry held_by_contact",
        "verification/bounds/verdicts": "verdicts verified_comparison",
    }.items()
}

#: Drawn mutants by module, each with the reason why no test can notice it.
EQUIVALENT: dict[str, dict[str, str]] = {
    "fem1d2d/assembly.py": {"assemble: max -> min": "numbers of nodes have 32 bits up to 2^31 entries of all cells"},
    "fem1d2d/line.py": {"_directions: 2 -> 3": "1 - SAME**2 / 2 is 1 as a double, with the cube too"},
    "ndtheory/energy_norms.py": {"_roots: 0 -> 1": "a root that does not exist may have any value"},
    "verification/algorithm/affine_piece.py": {
        "Piece.changes: self.sign.any() and kernel is not None -> self.sign.any()": "signs are of a kernel's stress"
    },
    "fem1d2d/pencil.py": {
        "extremes_by_solves: 0 -> 1": "the start is another random vector",
        "module: 8 -> 9": "the first look is a step later",
    },
    "fem1d2d/trace.py": {
        "_hats: len(grid) - 2 -> len(grid) + 2": "no segment begins at the last node, whose cell would be beyond"
    },
    "ndtheory/bounds.py": {
        "Answer.shared: corners and all((corner['high'] is not None for corner in corners)) -> corners": (
            "the last corner has an interval only if all have, and of no interval no end is rounded"
        )
    },
    "verification/algorithm/loop.py": {
        "Ending.__init__: 0 -> 1": "a residual that is so large for the first time has just grown"
    },
    "verification/algorithm/relaxation.py": {
        "InverseStep.__call__: r - self.last[0] -> r + self.last[0]": (
            "the length that a pair of columns is divided by does not change what they span"
        )
    },
    "verification/contact/active_set.py": {
        "module: 4000000 -> 8000000": "more linear systems are kept, and no digit depends on what is kept"
    },
}
