"""The JSON documents: keys and schemas as fixed, certified numbers as objects, null only with a reason."""

import html
import math
import re
from fractions import Fraction

import pytest

import ndtheory
import verification as vf
from verification.bounds.table import chosen
from verification.cli.problems import examples
from verification.registry import BOUNDS as TABLE

NUMBER = {"value", "lo", "hi", "level"}
LEVELS = {"exact", "verified", "guaranteed", "float"}

BOUNDS = {"C_K", "C_T", "C_T_tilde", "C0", "C1", "C2", "C3", "C4", "C5", "C6", "factor", "one_minus_factor"}
CONSTANTS = {"m", "M", "C_R", "C_s", "C_tr", "C_tr_half", "C_K", "rho_max", "rho_min", "rho_normal"}
RUN = {
    *{"theta", "relaxation", "neumann_body", "iterations", "evaluations", "outcome", "converged", "observed_rate"},
    *{"observed_rate_interval", "linearised_rate", "linearised_norm", "unrelaxed_residual", "kkt_residual", "solves"},
    *{"pattern", "contact", "force", "history", "observed_growth", "forecast"},
}
ENERGY = {"rho", "kappa_1", "kappa_2", "ratio", "friction_multiple", "factor_proved", "theta_max_proved"} | {
    "friction_limit_multiple"
}
VERDICTS = {"CONSISTENT", "VIOLATED", "INCONCLUSIVE", "HYPOTHESES_NOT_MET", "NOT_COMPUTED"}

GIVEN = ["--m", "3084", "--M", "153229", "--CR", "1.70"]
ON_ENERGY = ["--rho", "1/2", "--kappa1", "1/10", "--kappa2", "1/5"]
CALCULATIONS = {
    "bounds on C_K": [*GIVEN, "--CK", "1e-8", "--theta", "1e-4"],
    "bounds on k": [*GIVEN, "--k", "1e-13", "--Cs", "1e5", "--Ctr", "1/2", "--theta", "1e-4"],
    "bounds between C4 and C5": ["--m", "1", "--M", "1", "--CR", "1", "--CK", "0.55", "--theta", "1/10"],
    "bounds outside the interval": [*GIVEN, "--CK", "1", "--theta", "1/2"],
    "bounds without friction": [*GIVEN, "--k", "0", "--Cs", "0", "--Ctr", "0", "--theta", "1e-4"],
    "bounds without theta": [*GIVEN, "--CK", "1e-8"],
    "bounds of one edition": [*GIVEN, "--CK", "1e-8", "--edition", "printed"],
    "bounds of every kind": [*GIVEN, "--CK", "1e-8", *ON_ENERGY, "--theta", "1e-4"],
    "bounds in energy norms": [*ON_ENERGY, "--theta", "1/2"],
    "bounds in energy norms without friction": ["--rho", "3", "--theta", "1/3"],
    "bounds in energy norms without theta": ON_ENERGY,
    "bounds in energy norms outside the interval": ["--rho", "3", "--theta", "2/3"],
    "bounds in energy norms with much friction": ["--rho", "3", "--kappa1", "2", "--kappa2", "2", "--theta", "1/3"],
}
PROBLEMS = [
    None,
    "apart",
    "unloaded",
    "inside the theorem",
    "inside, unloaded",
    "without friction",
    "held tangentially",
    "local law",
    "wrong roles",
    "stiff upper body",
]
#: Those that change more than a run.
FEW = [None, "apart", "without friction", "held tangentially", "local law"]
#: Edits by which a theta and a relaxation are chosen.
CHOICES = [
    {"iteration.theta": '"auto"'},
    *({"iteration.relaxation": f'"{relaxation}"'} for relaxation in ("aitken", "anderson", "newton", "momentum")),
    {"iteration.relaxation": '"momentum"', "contact.friction": "0"},
]
DOCUMENTS = [
    *CALCULATIONS,
    *((command, edits) for command in ("run", "compare") for edits in [*PROBLEMS, *CHOICES]),
    *((command, edits) for command in ("constants", "solve", "advise") for edits in FEW),
]
SCHEMAS = {"advise": "advice"}


@pytest.fixture(scope="module")
def kept():
    """Documents by what they are of: each is computed once."""
    return {}


@pytest.fixture
def document(call, write, kept):
    def document(of):
        if str(of) not in kept:
            arguments = ["bounds", *CALCULATIONS[of]] if isinstance(of, str) else [of[0], write(of[1])]
            kept[str(of)] = call(*arguments, "--json").document
        return kept[str(of)]

    return document


def numbers(part, path=""):
    """Every certified number below a part of a document, with its path."""
    if isinstance(part, dict):
        if set(part) == NUMBER:
            yield path, part
        for key, value in part.items():
            yield from numbers(value, f"{path}.{key}")
    elif isinstance(part, list):
        for i, value in enumerate(part):
            yield from numbers(value, f"{path}[{i}]")


def unexplained(part, explained=frozenset(), path=""):
    """Paths of nulls for which no object on the way names a reason."""
    if isinstance(part, dict):
        if set(part) == NUMBER:
            return
        reasons = part.get("reason") or {}
        if isinstance(reasons, str):  # the reason of a method that is advised
            reasons = {}
        assert all(isinstance(reason, str) and reason for reason in reasons.values())
        explained = explained | set(reasons)
        for key, value in part.items():
            if value is None and key not in explained:
                yield f"{path}.{key}"
            yield from unexplained(value, explained, f"{path}.{key}")
    elif isinstance(part, list):
        for i, value in enumerate(part):
            if value is None:
                yield f"{path}[{i}]"
            yield from unexplained(value, explained, f"{path}[{i}]")


@pytest.mark.parametrize("of", DOCUMENTS, ids=str)
def test_a_document_names_its_schema_and_units_a_null_has_a_reason_and_a_number_its_level(document, of):
    found = document(of)
    assert found["schema"] == f"ndtheory.{'bounds' if isinstance(of, str) else SCHEMAS.get(of[0], of[0])}/1"
    assert found["version"] == ndtheory.__version__
    assert {"length", "stress"} <= set(found["units"])
    if not isinstance(of, str):
        assert found["units"] == {"length": "mm", "stress": "MPa"}
    assert list(unexplained(found)) == []
    for path, number in numbers(found):
        assert number["level"] in LEVELS, path
        if number["level"] == "float":
            assert number["lo"] is number["hi"] is None, path
        else:
            assert number["lo"] <= number["value"] <= number["hi"], path


@pytest.mark.parametrize("of", CALCULATIONS)
def test_bounds_hold_the_constants_of_every_edition(document, of):
    found = document(of)
    assert {"m", "M", "C_R", "C_K", "rho", "kappa_1", "kappa_2", "theta"} <= set(found["inputs"])
    assert set(found["editions"]) == {name for name, bound in TABLE.items() if bound.calculated}
    assert (found["editions"]["energy"] is not None) == ("--rho" in CALCULATIONS[of])
    assert {name for name, edition in found["editions"].items() if edition is None} == set(found["reason"])
    for name, edition in found["editions"].items():
        if edition is None or name not in ("printed", "repaired", "energy"):
            continue
        certified = {"factor", "one_minus_factor"} | (ENERGY if name == "energy" else BOUNDS)
        assert set(edition) >= certified | {"interval", "theta", "verdict"}
        for key in certified:
            assert edition[key] is None or set(edition[key]) == NUMBER
        assert (edition["verdict"] is None) == (edition["theta"] is None)
        assert edition["verdict"] in {"contraction", "no conclusion", None}
        assert (edition["factor"] is None) == (edition["verdict"] != "contraction")
        if edition["factor"] is not None:
            assert 0 <= edition["factor"]["value"] <= 1
            assert 0 < edition["one_minus_factor"]["value"] <= 1
            assert edition["interval"][0] < edition["theta"] < edition["interval"][1]


def test_C6_counts_only_between_C4_and_C5(document):
    inside = document("bounds between C4 and C5")["editions"]["repaired"]
    x, below, above = inside["C_K"]["value"], inside["C4"]["value"], inside["C5"]["value"]
    assert (inside["C6"] is not None) == (below < x)
    assert x < above or inside["interval"] is None
    assert document("bounds on C_K")["editions"]["repaired"]["C6"] is None


@pytest.mark.parametrize("edits", FEW, ids=str)
def test_constants_hold_both_bodies_and_the_interface(document, edits):
    found = document(("constants", edits))
    assert set(found) >= CONSTANTS | {"body1", "body2", "interface_nodes"}
    assert "levels" not in found
    assert found["interface_nodes"] == 7
    for name in CONSTANTS:
        assert found[name] is None or set(found[name]) == NUMBER
    for body, nodes in (("body1", 33), ("body2", 21)):
        assert found[body]["nodes"] == nodes
        assert 0 < found[body]["m"]["value"] < found[body]["M"]["value"]
    assert found["m"]["value"] == min(found[body]["m"]["value"] for body in ("body1", "body2"))
    assert found["M"]["value"] == sum(found[body]["M"]["value"] for body in ("body1", "body2"))


def test_levels_repeat_the_constants_of_each_mesh(call, write):
    found = call("constants", write(), "--refine", "1", "--json").document
    assert len(found["levels"]) == 2
    for level in found["levels"]:
        assert set(level) >= CONSTANTS | {"body1", "body2", "interface_nodes"}
    assert {name: found[name] for name in CONSTANTS} == {name: found["levels"][0][name] for name in CONSTANTS}


def assert_contact(found, nodes):
    """The objects `contact`, `pattern` and `force` that runs and solutions share."""
    contact, pattern = found["contact"], found["pattern"]
    assert set(contact) == {"x", "y", "s", "normal", "pressure", "shear", "bound", "gap", "slip", "state"}
    assert {len(values) for values in contact.values()} == {nodes}
    assert {state: contact["state"].count(state) for state in ("stick", "slip", "open")} == pattern
    assert set(found["force"]) == {"normal", "tangential", "vector"}
    assert found["force"]["vector"] == pytest.approx([found["force"]["tangential"], found["force"]["normal"]])
    assert {*map(tuple, contact["normal"])} == {(0.0, 1.0)}
    assert contact["s"] == pytest.approx([x - contact["x"][0] for x in contact["x"]])


@pytest.mark.parametrize("edits", FEW, ids=str)
def test_a_solution_holds_the_contact(document, edits):
    found = document(("solve", edits))
    assert set(found) >= {"force", "pattern", "contact", "kkt_residual"}
    assert_contact(found, 7)
    assert 0 <= found["kkt_residual"] < 1e-11


@pytest.mark.parametrize("edits", PROBLEMS, ids=str)
def test_a_run_holds_its_history_and_the_contact(document, edits):
    found = document(("run", edits))
    assert set(found) >= RUN
    assert found["outcome"] in {"converged", "stalled", "limit", "diverged", "interrupted"}
    assert found["converged"] == (found["outcome"] == "converged")
    assert found["relaxation"] == "constant"
    assert found["evaluations"] == len(found["history"]) == found["iterations"] + 1
    assert found["history"][-1] == found["unrelaxed_residual"]
    assert sum(found["solves"].values()) == found["evaluations"]
    assert set(found["solves"]) == {"cvxpy", "active_set"}
    assert_contact(found, 7)
    assert found["contact"]["x"] == pytest.approx([0.4 + 0.2 * i for i in range(7)], rel=1e-14)
    if found["observed_rate"] is not None:
        low, high = found["observed_rate_interval"]
        assert low <= found["observed_rate"] <= high


def test_pressure_and_shear_add_up_to_the_forces(document):
    found = document(("run", None))
    weights = [0.1, 0.2, 0.2, 0.2, 0.2, 0.2, 0.1]
    normal = math.fsum(w * p for w, p in zip(weights, found["contact"]["pressure"], strict=True))
    tangential = math.fsum(w * s for w, s in zip(weights, found["contact"]["shear"], strict=True))
    assert found["force"]["normal"] == pytest.approx(normal, rel=1e-12)
    assert found["force"]["tangential"] == pytest.approx(tangential, abs=1e-12 * normal)
    assert min(found["contact"]["pressure"]) >= 0 <= min(found["contact"]["gap"])


@pytest.mark.parametrize("edits", PROBLEMS, ids=str)
def test_a_comparison_holds_constants_bounds_run_and_verdicts(document, edits):
    found = document(("compare", edits))
    assert set(found) >= {"constants", "bounds", "energy", "lmi", "run", "verdicts"}
    assert set(found["bounds"]["editions"]) == {name for name, bound in TABLE.items() if not bound.apart}
    assert set(found["verdicts"].values()) <= VERDICTS | {None}


def test_a_comparison_has_a_verdict_for_every_bound_and_for_the_forecast(document):
    found = document(("compare", None))
    assert set(found["verdicts"]) == {*chosen(None), "linearised"} >= {"printed", "repaired", "energy", "lmi"}
    names = {"rho", "rho_normal", "kappa_1", "kappa_2", "factor", "theta_proved", "theta_max_proved"}
    assert names | {"theta_predicted", "friction_threshold", "friction_limit"} <= set(found["energy"])
    assert {"factor", "friction_threshold", "certified"} <= set(found["lmi"])


def test_the_bounds_of_a_comparison_grow_sharper_from_one_to_the_next(document):
    """|J| at most the semidefinite factor, at most the one in energy norms; thresholds the other way round."""
    found = document(("compare", None))
    assert found["run"]["linearised_norm"] <= found["lmi"]["lipschitz"]["value"]
    repaired = found["bounds"]["editions"]["repaired"]["C2"]["value"]
    assert repaired <= found["energy"]["friction_threshold"]["value"] <= found["lmi"]["friction_threshold"]["value"]
    assert found["energy"]["friction_threshold"]["value"] <= found["energy"]["friction_limit"]["value"]
    if found["energy"]["factor"] is not None:
        assert found["lmi"]["factor"]["value"] <= found["energy"]["factor"]["value"] * (1 + 1e-9)


@pytest.mark.parametrize("edits", [None, "local law", "held tangentially"], ids=str)
def test_a_comparison_holds_the_documents_of_the_single_commands(document, edits):
    common = {"schema", "version", "units", "problem"}
    found = document(("compare", edits))
    for part in ("constants", "run"):
        alone = document((part, edits))
        assert {key: found[part][key] for key in alone if key not in common} == {
            key: value for key, value in alone.items() if key not in common
        }


@pytest.mark.parametrize("name", sorted(examples()))
def test_an_example_as_a_document_is_its_text(call, name):
    assert call("example", name, "--json").document["toml"] == examples()[name]
    assert name in call("example", "--json").document["examples"]


# --- notebooks ---


@pytest.mark.parametrize(
    ("function", "edits"),
    [(vf.measure, None), (vf.run, "unloaded"), (vf.solve, "unloaded"), (vf.compare, "held tangentially")],
)
def test_a_result_shows_as_its_screen_in_a_notebook(write, function, edits):
    problem = vf.load(write(edits))
    shown = function(problem)._repr_html_()
    assert shown.startswith("<pre>")
    assert shown.endswith("</pre>")
    assert problem.title in html.unescape(shown)
    assert max(len(line) for line in html.unescape(shown)[5:-6].splitlines()) <= 80


def test_a_title_is_text_in_a_notebook(write):
    shown = vf.run(vf.load(write({"title": '"<script>alert(1)</script> & more"'})))._repr_html_()
    assert "<script" not in shown
    assert "&lt;script&gt;alert(1)&lt;/script&gt; &amp; more" in shown


# --- the calculator ---


@pytest.mark.parametrize("m", ["1/10", "1"])
def test_the_calculator_says_where_M_is_no_sum_and_the_theorem_as_printed_concludes_nothing_there(call, m):
    """With M^1 = M^2 = m = 1/10 a step may multiply errors by 1.3 where it would promise less than 1."""
    given = ["bounds", "--m", m, "--CR", "1", "--CK", "1e-4", "--theta", "1/5", "--M"]
    less, enough = (call(*given, M, "--json").document["editions"] for M in (m, str(2 * Fraction(m))))
    assert "M < 2 m: no two bodies have that" in call(*given, m).out
    assert call(*given, m, "--json").err.startswith("warning: M < 2 m: no two bodies have that")
    assert "M < 2 m" not in str(call(*given, str(2 * Fraction(m)), "--json"))
    assert "M < 2 m" not in call(*given, str(2 * Fraction(m))).out
    assert enough["printed"]["verdict"] == less["repaired"]["verdict"] == "contraction"
    assert less["printed"]["verdict"] == ("no conclusion" if m == "1/10" else "contraction")
    assert ("M >= 2 m" in less["printed"]["reason"].get("interval", "")) == (m == "1/10")
    assert call(*given, m, "--check").status == 0  # by the repaired edition


def test_the_examples_of_the_calculator_are_about_sums(call):
    examples = re.findall(r"--m (\S+) --M (\S+)", call("bounds", "--help").out)
    assert examples
    assert all(Fraction(M) >= 2 * Fraction(m) for m, M in examples)
