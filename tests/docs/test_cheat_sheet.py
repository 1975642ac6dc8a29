"""The cheat sheet has the formulas of the library with its values; its PDF is one page that holds all of its text."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

import verification as vf
from ndtheory import energy_norms

#: Formulas of the sheet that stand in the library, too, and the unknowns they have there.
FORMULAS = {
    "its best theta": (energy_norms.predicted_theta, ("normal",)),
    "its factor per step": (energy_norms.predicted_rate, ("normal",)),
    "friction: the predicted best theta": (energy_norms.predicted_theta, ("rho",)),
    "their best theta (with friction: predicted if nothing opens or slips)": (energy_norms.tied_theta, ("low", "rho")),
    "every small theta contracts if": (energy_norms.friction_number, ("kappa_1", "kappa_2")),
}


@pytest.fixture(scope="module")
def lines(builder):
    return {line.question: line for part in builder.cheat_sheet.parts() for line in part.lines}


def python(formula):
    """A formula of the sheet as an expression of Python."""
    text = (
        formula.removesuffix(" < 1")
        .replace(r"\rho_N", "normal")
        .replace(r"\rho_{\min}", "low")
        .replace("^2", "**2")
        .replace("\\", "")
    )
    assert re.fullmatch(r"[\w\s()+*/.-]+", text), formula
    return compile(text, formula, "eval")


@given(
    value=st.fixed_dictionaries({name: st.floats(1e-3, 1e3) for name in ("rho", "normal", "low", "kappa_1", "kappa_2")})
)
@pytest.mark.parametrize("question", FORMULAS)
def test_a_formula_of_the_sheet_is_that_of_the_library(lines, question, value):
    function, names = FORMULAS[question]
    shown = eval(python(lines[question].formula), value)
    assert shown == pytest.approx(function(*(value[name] for name in names)), rel=1e-12)


def test_the_examples_of_a_run_give_back_the_ratios_of_the_bodies(lines):
    rho = lines["stiffness of the contact body over that of the Neumann body on the interface, at most"].example
    assert lines["no friction, or tied bodies: the residual changes its sign"].example.endswith(f": {rho}")
    exchanged = float(lines["rho with the roles exchanged"].example)
    kept = float(lines["tied bodies only: the residual keeps its sign"].example.rpartition(" ")[2])
    assert 1 / kept == pytest.approx(exchanged, rel=0.02)


def test_what_is_proved_without_friction_is_what_advise_finds_there(lines):
    """The largest ratio of all displacements, tangential ones included, belongs to tied bodies and to predictions."""
    role = vf.advise(vf.example("section6").changed(friction=0)).best
    assert lines["its best theta"].example == f"{role.theta_proved:.3f}"
    assert lines["its factor per step"].example == f"{role.factor_proved.value:.3f}"
    predicted = vf.advise(vf.example("section6")).best
    assert lines["friction: the predicted best theta"].example == f"{predicted.theta_predicted:.3f}"
    assert role.theta_proved > predicted.theta_predicted


def test_a_column_of_the_pdf_ends_before_the_next_one(builder):
    figure = builder.cheat_sheet.drawn()
    figure.canvas.draw()
    width, height = figure.bbox.width, figure.bbox.height
    boxes = [text.get_window_extent() for text in figure.texts]
    assert all(box.x0 >= 0 and box.x1 <= width and box.y0 >= 0 and box.y1 <= height for box in boxes)
    crossing = [
        (a, b) for n, a in enumerate(boxes) for b in boxes[:n] if a.shrunk(0.98, 0.8).overlaps(b.shrunk(0.98, 0.8))
    ]
    assert crossing == []


def test_the_page_and_the_pdf_are_written(builder, tmp_path):
    builder.cheat_sheet.write(tmp_path)
    page = (tmp_path / "cheat_sheet.md").read_text("utf-8")
    pdf = (tmp_path / "cheat_sheet.pdf").read_bytes()
    assert all(line.formula in page for part in builder.cheat_sheet.parts() for line in part.lines)
    assert len(re.findall(rb"/Type /Page\b", pdf)) == 1
