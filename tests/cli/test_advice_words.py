"""Words and lines of advice by the kind of the coupling: what is pasted, quoted, not claimed, and typed next."""

import numpy as np
import pytest
from coupling_logs import precice

import verification as vf
from verification.show.layout import text

FLUID = ("--density", "1000,1200", "--thickness", "1e-3", "--length", "0.05")
HEAT = ("--conductivity", "50,0.5")
ELASTIC = ("--young", "7e4,2e4", "--poisson", "0.3,0.3")
CONTACT_WORDS = ("stiffness", "opens or slips", "Gamma_c", "contact changes", "or where contact")


def rows(values, theta, fields=1, count=7):
    """Iterates and images of a linear coupling, in parallel with the displacement behind the force."""
    values, x, X, TX = np.array(values), np.zeros(fields * len(values)), [], []
    for _ in range(count):
        g, u = x[: len(values)], x[-len(values) :]
        image = 1 - values * g if fields == 1 else np.concatenate([1 - values * u, g + 0.5])
        X.append(x)
        TX.append(image)
        x = x + theta * (image - x)
    return np.array(X), np.array(TX)


def joined(found):
    return " ".join(text(found.sections()).split())


@pytest.mark.parametrize("kind", ["tied", "general"])
@pytest.mark.parametrize("values", [(0.3, 0.8, 2.5), (0.02, 0.05, 0.4)])
def test_vectors_of_a_declared_coupling_have_no_words_of_contact(kind, values):
    said = joined(vf.advise_vectors(*rows(values, 0.3), kind=kind))
    assert [word for word in CONTACT_WORDS if word in said] == []
    assert "opens or slips" in joined(vf.advise_vectors(*rows(values, 0.3)))


@pytest.mark.parametrize(("kind", "parallel"), [("tied", False), ("tied", True), ("general", False)])
def test_logs_of_a_declared_coupling_have_no_words_of_contact(tmp_path, kind, parallel):
    logs = []
    for ratios in ([0.6], [0.6, 0.4], [1.2], [1.0]):
        residuals = [np.prod(np.resize(ratios, k)) for k in range(60)]
        logs.append(precice(tmp_path / f"{len(logs)}.log", [{"ResAbs(M:F)": residuals}]))
    for log in logs:
        said = joined(vf.advise_logs([(log, "0.4")], kind=kind, parallel=parallel)).replace(
            "nothing opens or slips", ""
        )
        assert [word for word in CONTACT_WORDS if word in said] == []


@pytest.mark.parametrize("given", [FLUID, HEAT, ELASTIC, (*ELASTIC, "--tied")])
@pytest.mark.parametrize("parallel", [(), ("--parallel",)])
def test_the_command_to_type_next_keeps_the_kind(call, given, parallel):
    last = call("advise", "moduli", *given, *parallel).out.partition("Next: ")[2]
    assert ("--parallel" in last) == bool(parallel)
    assert ("--tied" in last) == (given != ELASTIC)


def test_both_fields_are_pasted_in_parallel_coupling_and_whole_blocks_are_offered_only_where_there_are_some():
    values = np.linspace(0.5, 60, 8)
    serial, both = (vf.advise_vectors(*rows(values, 0.01, n, 22), kind="tied", parallel=n == 2) for n in (1, 2))
    for found, names in ((serial, ("Force",)), (both, ("Force", "Displacement"))):
        said = text(found.sections())
        assert found.method_to_paste == "iqn-ils"
        assert [name for name in ("Force", "Displacement") if f'<data name="{name}"' in said] == list(names)
        assert ("--snippets" in said) == (found is serial)


def test_a_theta_above_1_is_pasted_into_no_block():
    said = text(vf.advise_vectors(*rows((-0.5, -0.4, -0.3), 1.0), kind="general").sections())
    assert "preCICE takes a factor of at most 1" in said
    assert "<acceleration" not in said
    assert "--snippets" not in said


def test_the_theta_of_a_plate_is_shown_pasted_and_counted_as_it_is_rounded():
    """theta = 1/1.01 has the factor 0, and 0.99, which is pasted, 1e-4."""
    found = vf.advise_moduli(conductivity=(50, "0.5"))
    assert [row.theta for row in found.methods if row.method == "constant"] == [0.99, 0.0099]
    assert found.method.reason.startswith(f"{min(row.steps for row in found.methods)} steps, and no method takes fewer")
    assert "1.00e-4" in text(found.sections()) or "0.0001" in text(found.sections())


@pytest.mark.parametrize("ratios", [("0.8", "0.6"), ("0.6", "0.3")])
def test_a_steady_ratio_is_not_denied(tmp_path, ratios):
    logs = []
    for theta, ratio in zip(("0.5", "1"), ratios, strict=True):
        residuals = [float(ratio) ** k for k in range(60)]
        logs.append((precice(tmp_path / f"{theta}.log", [{"ResAbs(M:F)": residuals}]), theta))
    said = joined(vf.advise_logs(logs, kind="general"))
    assert "steady; ratio" in said
    assert "no time window shows a steady ratio" not in said


def test_a_problem_file_is_no_log_and_no_pattern_begins_inside_a_word(call, tmp_path):
    problem, other = tmp_path / "my.toml", tmp_path / "out.txt"
    problem.write_text(call("example", "section6").out, encoding="utf-8")
    complaint = call("advise", "run", "--log", problem, "--theta", "0.5").complaint
    assert f"this is a problem file: ndtheory advise {problem}" in complaint
    other.write_text("prescribed = 0.5\npressure 3.5\nrel_norm = 0.25\n" * 3, encoding="utf-8")
    complaint = call("advise", "run", "--log", other, "--theta", "0.5").complaint
    assert "--pattern 'rel_norm" in complaint


def test_the_help_offers_no_kind_that_is_refused(call):
    assert "general" not in call("advise", "moduli", "--help").out
    assert "general" in call("advise", "vectors", "--help").out
    assert "needed one of contact, tied" in call("advise", "moduli", *HEAT, "--kind", "general").complaint


def test_a_bound_is_rounded_to_its_side_and_so_is_the_theta_that_it_excludes(call):
    """rho is at least 85.47 in a tube, and theta diverges from 0.02313 on."""
    tube = call("advise", "moduli", *FLUID[:-1], "0.05,0.005").out
    assert "rho >= 85.4: added mass" in tube
    assert "Theta from 0.0232 on diverges." in tube
    heat = call("advise", "moduli", *HEAT).out  # rho = 100 with the roles exchanged
    assert "0.0199" in heat


def test_a_run_names_the_neumann_body_with_a_capital_and_no_option_that_is_refused(call):
    run = ("advise", "run", "--theta", "0.9", "--ratio", "1.5")
    assert "The Neumann body's solver reads forces" in call(*run, "--tied").out
    assert "add --friction" in call(*run).out
    assert "add --friction" not in call(*run, "--parallel").out
    assert call(*run, "--parallel", "--friction").status == 2
