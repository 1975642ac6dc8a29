"""README and the page on the first run show what the program prints."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from verification import comparison
from verification.cli import main
from verification.show.layout import lines

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text("utf-8")
FIRST_RUN = (ROOT / "docs" / "first_run.md").read_text("utf-8")


def test_the_page_on_the_first_run_shows_the_output_of_demo(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shown, in_full = re.findall(r"```text\n(.*?)```", FIRST_RUN, re.S)
    compare, kept = comparison.compare, []
    monkeypatch.setattr(comparison, "compare", lambda *given, **more: kept.append(compare(*given, **more)) or kept[0])
    monkeypatch.chdir(tmp_path)
    assert main(["demo"]) == 0
    printed = capsys.readouterr().out
    *whole, following = in_full.splitlines()
    assert printed.splitlines()[-1] == following
    full = [line for line, _ in lines(kept[0].sections(), "terminal")]
    # the KKT residual is rounding itself, the difference the error of a solver: they may differ between machines
    steady = lambda text: re.sub(r"(step II|T differs by) \S+", r"\1", text).split("\n")
    assert steady(shown.rstrip()) == steady(printed.rstrip())
    assert steady("\n".join(whole)) == steady("\n".join(full))


def test_no_line_of_prose_is_wider_than_120_columns() -> None:
    prose = re.sub(r"```.*?```", "", README, flags=re.S).splitlines()
    assert [line for line in prose if len(line) > 120 and not line.startswith(("    ", "!["))] == []


def test_the_python_example_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from verification.cli.problems import examples

    code = re.search(r"```python\n(.*?)```", README, re.S)
    assert code is not None
    monkeypatch.chdir(tmp_path)
    Path("my.toml").write_text(examples()["section6"], "utf-8")
    exec(compile(code[1], "README.md", "exec"), {})


def test_the_way_from_make_to_the_command_is_told_before_the_first_command_is_shown() -> None:
    before = README.partition("\n    ndtheory ")[0]
    assert "source .venv/bin/activate" in before
    assert ".venv/bin/ndtheory " in before
    assert "pip install ." in before
    assert "VENV   := .venv\nBIN    := $(VENV)/bin\n" in (ROOT / "Makefile").read_text("utf-8")


def test_every_command_shown_exists(capsys: pytest.CaptureFixture[str]) -> None:
    for name in sorted(set(re.findall(r"^    ndtheory (\w+)", README, re.M))):
        assert main([name, "--help"]) == 0


def test_the_readme_names_pages_and_pictures_that_exist() -> None:
    named = {*re.findall(r"`(docs/[\w./]+)`", README), *re.findall(r"\]\(([\w./]+)\)", README)} - {"docs/_build/html"}
    assert {"docs/first_run.md", "docs/algorithm.svg"} <= named
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_the_numbers_that_the_readme_explains_are_those_of_section_6() -> None:
    import verification as vf
    from verification.coupling.roles import steps

    advice = vf.advise(vf.example("section6"))
    lower, upper = advice.roles
    text = " ".join(README.split())
    assert f"give rho = {lower.rho.value:.3f}:" in text
    assert f"2/1.475 = {2 / (1 + lower.rho.value):.2f}" in text
    assert f"below theta = {2 / (1 + upper.rho.value):.3f}, and {steps(upper.rate_predicted)} steps" in text
    assert f"2/2.475 = {lower.theta_predicted:.2f}" in text
    assert f"the same model has rho = {upper.rho.value:.1f}" in text


def test_the_readme_has_a_formula_for_bodies_that_touch_and_one_for_tied_ones_and_what_each_takes() -> None:
    from ndtheory.energy_norms import predicted_theta, tied_factor, tied_theta
    from verification.coupling.roles import steps

    low, high = 2.78, 36.0
    tied, touching = (steps(tied_factor(theta, low, high)) for theta in (tied_theta(low, high), predicted_theta(high)))
    told = f"from {low} to {high}, this theta needs {tied} steps to an error of 1e-9, and 2/(2 + rho) needs {touching}."
    assert told in " ".join(README.split())
