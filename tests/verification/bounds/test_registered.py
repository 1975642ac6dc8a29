"""A bound, a rule and a law that are registered appear wherever those of this library do; no place has to name them."""

import pytest
from made_up import Cautious, Exponential, Finding, Halfway, Silent, Slow, TooGood
from problem_list import small

import verification as vf
from verification import figures
from verification.bounds.table import certifying
from verification.output.report import report
from verification.registry import BOUNDS, LAWS, RULES
from verification.sweeps import region
from verification.sweeps.grid import SweepGrid

PROBLEM = vf.Problem.from_dict(small())


@pytest.fixture
def registered(monkeypatch):
    """``registered(bound, rule, law)`` puts each into its table; the semidefinite bound goes, which takes long."""
    monkeypatch.delitem(BOUNDS, "lmi")

    def register(*things):
        for thing in things:
            table = BOUNDS if hasattr(thing, "evaluate") else RULES if hasattr(thing, "begin") else LAWS
            monkeypatch.setitem(table, thing.name, thing)

    return register


def legend(figure):
    boxes = [ax.get_legend() for ax in figure.axes] + list(figure.legends)
    return [text.get_text() for box in boxes if box is not None for text in box.get_texts()]


# --- a bound ---


@pytest.fixture
def compared(registered, shared):
    registered(Halfway(), Silent(), Slow())
    return shared("three bounds are registered", lambda: vf.compare(PROBLEM))


def test_a_registered_bound_is_worked_out_judged_and_written(compared):
    found, energy = compared.bounds["halfway"], compared.bounds["energy"]
    assert found.factor.value == pytest.approx((1 + energy.factor.value) / 2, rel=1e-14)
    assert compared.verdicts["halfway"].verdict == "CONSISTENT"
    document = compared.to_dict()
    written = document["bounds"]["editions"]["halfway"]
    assert written["factor"]["value"] == found.factor.value
    assert written["interval"] == list(energy.interval)
    assert (written["verdict"], document["verdicts"]["halfway"]) == ("contraction", "CONSISTENT")
    assert "halfway CONSISTENT" in repr(compared)


def test_one_that_applies_to_nothing_is_null_with_its_reason(compared):
    document, why = compared.to_dict(), "made up: it applies to nothing"
    assert (document["bounds"]["editions"]["silent"], document["verdicts"]["silent"]) == (None, "NOT_COMPUTED")
    reasons = [document["bounds"]["reason"], document["reason"], document["reasons"]]
    assert [each["silent"] for each in reasons] == [why] * 3


def test_one_that_takes_the_matrices_comes_last(compared):
    editions = compared.to_dict()["bounds"]["editions"]
    assert editions["slow"]["factor"] == editions["halfway"]["factor"]
    assert compared.cvxpy is not None


def test_a_bound_without_a_conclusion_says_so(registered):
    registered(Halfway())
    found = vf.compare(PROBLEM.changed(friction=5), bounds=["halfway"])
    assert found.verdicts["halfway"].verdict == "HYPOTHESES_NOT_MET"
    assert found.to_dict()["bounds"]["editions"]["halfway"]["reason"]["factor"] == found.bounds["halfway"].why


@pytest.mark.parametrize(
    ("bound", "fault"), [(TooGood(), True), (Finding(), False), (Halfway(), False)], ids=["too good", "finding", "true"]
)
def test_a_registered_bound_that_is_violated_is_a_fault_unless_it_is_a_finding(registered, bound, fault):
    registered(bound)
    found = vf.compare(PROBLEM, bounds=[bound.name])
    assert (found.verdicts[bound.name].verdict == "VIOLATED") == (bound.factor > 1)
    assert found.proved_violated == fault


def test_it_is_drawn_beside_the_residuals_and_stands_in_the_report(compared):
    assert {"halfway bound", "slow bound", "energy bound"} <= set(legend(compared.plot()))
    page = report(compared, {})
    assert all(f'<th scope="row">{name}</th>' in page for name in ("halfway", "silent", "slow"))


def test_its_region_is_traced_written_and_drawn(registered, monkeypatch):
    registered(Halfway())
    monkeypatch.setattr(region, "THETAS", (0.2, 0.6))
    monkeypatch.setattr(region, "FRICTIONS", (0.1, 0.9))
    plane = region.chart(PROBLEM)
    assert plane.to_dict()["regions"]["halfway"] == plane.to_dict()["regions"]["energy"]
    assert any(words.startswith("halfway: k < ") for words in legend(figures.draw_region(plane)))
    assert any(words.startswith("printed (MPa): k < ") for words in legend(figures.draw_region(plane)))


def test_it_can_propose_a_certificate(registered, monkeypatch):
    with pytest.raises(ValueError, match=rf"edition 'halfway': needed one of {', '.join(certifying())}$"):
        vf.certify(PROBLEM, edition="halfway")
    monkeypatch.setattr(Halfway, "certifies", True)
    registered(Halfway())
    found = vf.certify(PROBLEM, edition="halfway")
    assert vf.certify(PROBLEM).edition == "energy"  # lmi is not there: see `registered`
    assert float(vf.certify(PROBLEM, edition="energy").factor) < float(found.factor) < 1
    assert vf.check_again(found.to_dict(), PROBLEM).accepted


# --- a rule ---


def test_a_registered_rule_is_read_run_and_written(registered):
    registered(Cautious())
    problem = PROBLEM.changed(relaxation="cautious", theta="0.8")
    run, twice = vf.run(problem), vf.run(PROBLEM, theta="0.4")
    assert run.history == pytest.approx(twice.history, rel=1e-6)
    document = run.to_dict()
    assert document["relaxation"] == document["problem"]["iteration"]["relaxation"] == "cautious"
    assert run.outside == ["half steps: nothing is proved of them"]
    assert "cautious relaxation" in run._repr_html_()
    assert vf.Problem.from_dict(problem.to_dict()) == problem


def test_it_is_a_value_of_a_sweep_and_of_its_store(registered, tmp_path):
    registered(Cautious())
    again = [vf.sweep(PROBLEM, rule=["constant", "cautious"], store=tmp_path / "rows.sqlite") for _ in range(2)]
    assert [row["rule"] for row in again[1].rows] == ["constant", "cautious"]
    assert [found.stored for found in again] == [0, 2]


# --- a law ---


def test_a_registered_law_is_read_run_and_written(registered):
    registered(Exponential)
    problem = PROBLEM.changed(law="made-up")
    run = vf.run(problem)
    assert run.pair.interface.law == Exponential(radius=float(problem.contact.radius))
    assert run.to_dict()["problem"]["contact"]["law"] == "made-up"
    assert "exponential, r = " in run._repr_html_()
    assert "exponential" in vf.compare(problem, bounds=["energy"])._repr_html_()
    assert list(run.contact.pressure) != list(vf.run(PROBLEM).contact.pressure)


def test_it_is_a_value_of_a_sweep_and_has_a_region(registered, monkeypatch):
    registered(Exponential, Halfway())
    rows = vf.sweep(PROBLEM, law=["nonlocal", "made-up"]).rows
    assert [(row["law"], row["outcome"]) for row in rows] == [("nonlocal", "converged"), ("made-up", "converged")]
    monkeypatch.setattr(region, "THETAS", (0.2, 0.6))
    monkeypatch.setattr(region, "FRICTIONS", (0.1, 0.9))
    plane = region.chart(PROBLEM.changed(law="made-up"))
    assert {"energy", "halfway"} <= set(plane.regions)
    assert len(plane.points) == 4


@pytest.mark.parametrize(("axis", "known"), [("law", LAWS), ("rule", RULES)])
def test_the_values_of_an_axis_are_those_of_the_moment(registered, axis, known):
    before = ", ".join(f'"{name}"' for name in known)
    name = "made-up" if axis == "law" else "cautious"
    with pytest.raises(vf.ProblemError, match=f"needed one of {before}$"):
        SweepGrid.of({axis: [name]})
    registered(Exponential, Cautious())
    assert SweepGrid.of({axis: [name]}).axes[axis] == (name,)
