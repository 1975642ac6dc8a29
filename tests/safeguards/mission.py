"""Modules that constants, bounds, runs and their comparison rest on, and tests of them."""

from __future__ import annotations


def _tests(names: str) -> tuple[str, ...]:
    return tuple(f"tests/{name.replace('/', '/test_')}.py" for name in names.split())


#: The files of tests that are about each module, the one most likely to notice a change first.
MISSION: dict[str, tuple[str, ...]] = {
    f"{module}.py": _tests(tests)
    for module, tests in {
        "fem1d2d/assembly": "fem1d2d/assembly fem1d2d/uncoupled fem1d2d/polygons fem1d2d/condense",
        "fem1d2d/condense": "fem1d2d/flexibility fem1d2d/condense fem1d2d/uncoupled verification/few_unknowns",
        "fem1d2d/element": "fem1d2d/element fem1d2d/strain fem1d2d/assembly fem1d2d/material",
        "fem1d2d/line": "fem1d2d/line verification/lines",
        "fem1d2d/mesh": "fem1d2d/mesh fem1d2d/overlap fem1d2d/supports fem1d2d/outline",
        "fem1d2d/pencil": "fem1d2d/bars fem1d2d/refinement fem1d2d/pencil",
        "fem1d2d/supports": "fem1d2d/supports fem1d2d/refinement",
        "fem1d2d/trace": "fem1d2d/transfer fem1d2d/trace",
        "ndtheory/bounds": "ndtheory/bounds_hypotheses ndtheory/bounds ndtheory/enclosures",
        "ndtheory/constants": "ndtheory/bounds_hypotheses ndtheory/energy_hypotheses ndtheory/enclosures",
        "ndtheory/energy_norms": "safeguards/energy_safe ndtheory/energy_norms ndtheory/energy_hypotheses",
        "ndtheory/number": "ndtheory/number ndtheory/enclosures",
        "verification/algorithm/affine_piece": "verification/jacobian verification/margin",
        "verification/algorithm/arrival": "verification/arrival verification/iteration",
        "verification/algorithm/fixed_point": "verification/lean_step verification/iteration verification/relaxation",
        "verification/algorithm/loop": "verification/arrival verification/iteration",
        "verification/algorithm/linearisation": "verification/jacobian verification/prediction verification/margin",
        "verification/algorithm/rates": "safeguards/rates_safe verification/rates",
        "verification/algorithm/relaxation": "verification/relaxation verification/conformance",
        "verification/algorithm/runs": "verification/iteration verification/results verification/held_by_contact",
        "verification/semidefinite/conditions": "safeguards/multipliers_safe verification/lifted verification/exact",
        "verification/semidefinite/interior_point": "verification/interior_point verification/exact",
        "verification/semidefinite/lipschitz": (
            "verification/mirror verification/exact verification/verified_comparison"
        ),
        "verification/semidefinite/multipliers": (
            "safeguards/multipliers_safe verification/multipliers verification/exact"
        ),
        "verification/semidefinite/trace_forms": (
            "verification/rounding_of_forms verification/rounding_of_forms_in_friction"
        ),
        "verification/comparison": "verification/compare_bounds verification/verdicts cli/first_numbers",
        "verification/constants/measuring": "verification/constants verification/energy_constants",
        "verification/constants/operators": "verification/operators",
        "verification/contact/active_set": "verification/rigid_motion verification/contact verification/lean_step",
        "verification/contact/kkt": "safeguards/kkt verification/contact",
        "verification/contact/step": "verification/rigid_motion verification/contact verification/held_by_contact",
        "verification/contact/system": "verification/global verification/few_unknowns",
        "verification/interface/body": "verification/response verification/few_unknowns verification/constants",
        "verification/interface/friction": "verification/warnings verification/build verification/grids",
        "verification/interface/interface": "verification/build verification/grids verification/conformance",
        "verification/interface/joining": "safeguards/joining verification/drawn_geometry verification/lines",
        "verification/interface/pair": "verification/build verification/relaxation verification/constants",
        "verification/algorithm/monolithic": "verification/global verification/checks verification/drawn_geometry",
        "verification/bounds/verdicts": "verification/verdicts verification/verified_comparison",
    }.items()
}

#: Drawn mutants by module, each with the reason why no test can notice it.
EQUIVALENT: dict[str, dict[str, str]] = {
    "fem1d2d/line.py": {"_directions: 1 - SAME ** 2 / 2 -> 1 + SAME ** 2 / 2": "as doubles both are 1"},
    "fem1d2d/trace.py": {
        "_hats: len(grid) - 2 -> len(grid) + 2": "no segment begins at the last node, whose cell would be beyond"
    },
    "ndtheory/bounds.py": {
        "Answer.shared: corners and all((corner['high'] is not None for corner in corners)) -> corners": (
            "the last corner has an interval only if all have, and of no interval no end is rounded"
        )
    },
    "verification/algorithm/loop.py": {
        "Ending.__init__: 0 -> 1": "the first residual is below infinity, which sets the count to 0"
    },
    "verification/semidefinite/lipschitz.py": {
        "_division: free & (pieces.slip == 0) -> free": "the slip of a node is fixed only once its sign is"
    },
    "verification/contact/active_set.py": {
        "module: 4000000 -> 8000000": "more linear systems are kept, and no digit depends on what is kept"
    },
}
