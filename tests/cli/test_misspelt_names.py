"""A name that is not known is answered with the one that may be meant; a file of another kind is named as such."""

import pytest
from complaints import assert_names

import verification as vf
from verification.cli.main import cli

SWEEP = 'problem = "section6"\n[grid]\ntheta = [0.3]\n'


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        ("example sektion6", "section6"),
        ("example twobars", "two-bars"),
        ("Compare FILE", "compare"),
        ("advice FILE", "advise"),
        ("run FILE --solver activeset", "active-set"),
        ("run FILE --relaxation Aitken", "aitken"),
        ("compare FILE --relaxation constnat", "constant"),
        ("certify FILE --edition repair", "repaired"),
        ("bounds --edition prined", "printed"),
        ("verify --level ful", "full"),
        ("reproduce fig-12", "fig12"),
        ("advise FILE --snippets preCISE", "preCICE"),
        ("advise moduli --young 1,2 --poisson 0,0 --shape corners-bth", "corners-both"),
    ],
)
def test_a_misspelt_name_is_answered_with_the_one_that_is_meant(call, write, words, meant):
    file = str(write())
    assert f"did you mean '{meant}'?" in call(*words.replace("FILE", file).split()).complaint


@pytest.mark.parametrize("words", ["example wibble", "wibble", "run FILE --solver x", "reproduce wibble"])
def test_a_name_that_resembles_none_is_answered_with_no_guess(call, words):
    assert "did you mean" not in call(*words.split()).complaint


def test_an_unknown_example_is_answered_alike_from_python():
    with pytest.raises(ValueError, match=r"no example 'sektion6'; there are .*; did you mean 'section6'\?"):
        vf.example("sektion6")


def test_a_long_word_is_compared_in_no_time_and_not_repeated(call):
    line = call("example", "section6" * 10000).complaint
    assert len(line) < 700


@pytest.mark.parametrize(
    ("key", "value", "meant"), [("contact.law", "nonlocel", "nonlocal"), ("iteration.relaxation", "aitkin", "aitken")]
)
def test_a_misspelt_value_of_a_file_is_answered_alike(call, write, key, value, meant):
    assert f"did you mean '{meant}'?" in call("run", write(), "--set", f"{key}={value}").complaint


@pytest.mark.parametrize(
    ("pair", "meant"),
    [
        ("friction=0.4", "did you mean 'contact.friction'?"),
        ("theta=0.4", "did you mean 'iteration.theta'?"),
        ("young=1", "did you mean 'body1.young' or 'body2.young'?"),
        ("relaxation=newton", "did you mean 'iteration.relaxation'?"),
        ("stress=Pa", "did you mean 'units.stress'?"),
        ("top=[0,1]", "known here: title, dimension, plane, units, norm, body1, body2, contact, iteration, step"),
    ],
)
def test_a_key_without_its_table_is_answered_with_the_tables_that_have_it(call, write, pair, meant):
    assert call("run", write(), "--set", pair).complaint.endswith(f"unknown key; {meant}")


@pytest.mark.parametrize("value", ["70 GPa", "2.1e5MPa", "7e4 N/mm^2", "1/3 GPa", "1,5 MPa"])
def test_a_value_with_its_unit_is_answered_that_files_have_none(call, write, value):
    assert call("run", write(), "--set", f"body1.young={value}").complaint.endswith(
        "needed a number > 0, without a unit"
    )


@pytest.mark.parametrize("value", ["1e", "1e-", '"1e400"', "1e5.5", "0x10g", ".x", "auto", "1/3x"])
def test_a_text_without_a_unit_is_not_said_to_have_one(call, write, value):
    assert "without a unit" not in call("run", write(), "--set", f"body1.young={value}").complaint


def test_a_vector_with_units_is_answered_alike(call, write):
    line = call("run", write(), "--set", 'body2.prescribed.top=["0 mm", "-1 mm"]').complaint
    assert line.endswith('along x and y ("free" leaves a component free), without a unit')


def test_a_misspelt_example_in_the_file_of_a_sweep_is_answered_alike(call, tmp_path):
    (tmp_path / "grid.toml").write_text(SWEEP.replace("section6", "sektion6"), encoding="utf-8")
    assert "did you mean 'section6'?" in call("sweep", tmp_path / "grid.toml").complaint


@pytest.mark.parametrize("words", [["--dry-run"], ["--json"]])
def test_a_problem_file_given_to_sweep_is_named_as_one(call, write, tmp_path, words):
    file = write()
    line = call("sweep", file, *words).complaint
    assert_names(line, str(file), "this is a problem file", f'problem = "{file.name}"', "[grid] theta = [0.3, 0.5]")
    (tmp_path / "grid.toml").write_text(f'problem = "{file.name}"\n[grid]\ntheta = [0.3, 0.5]\n', encoding="utf-8")
    assert call("sweep", tmp_path / "grid.toml", "--dry-run").status == 0


@pytest.mark.parametrize(
    "words", ["run", "compare", "constants", "solve", "advise", "certify", "region -o plane.svg", "run --theta 0.3"]
)
def test_the_file_of_a_sweep_given_to_another_command_is_named_as_one(call, tmp_path, words):
    (tmp_path / "grid.toml").write_text(SWEEP, encoding="utf-8")
    name, *options = words.split()
    line = call(name, tmp_path / "grid.toml", *options).complaint
    assert_names(line, "this is the file of a sweep", f"ndtheory sweep {tmp_path / 'grid.toml'}")
    with pytest.raises(vf.ProblemError, match="file of a sweep"):
        vf.load(tmp_path / "grid.toml")


def test_a_sweep_of_a_sweep_is_refused(call, tmp_path):
    (tmp_path / "grid.toml").write_text(SWEEP, encoding="utf-8")
    (tmp_path / "other.toml").write_text(SWEEP.replace("section6", "grid.toml"), encoding="utf-8")
    assert "this is the file of a sweep" in call("sweep", tmp_path / "other.toml").complaint


#: What `-o` is of each command: a folder, or the one file that it makes.
OUTPUT = {
    **dict.fromkeys(["run", "solve", "march", "compare", "demo", "sweep", "reproduce", "verify"], "DIR"),
    "bounds": "FILE.svg",
    "layers": "FILE.svg",
    "explore": "FILE.html",
    "region": "FILE.svg",
    "certify": "FILE.json",
}


def test_the_metavar_of_an_output_says_whether_it_is_a_folder_or_which_file():
    made = {
        name: parameter.metavar
        for name, command in cli.commands.items()
        for parameter in command.params
        if "-o" in parameter.opts
    }
    assert made == OUTPUT


def test_roles_are_exchanged_by_one_name():
    named = {
        option
        for command in cli.commands.values()
        for form in (command.forms().values() if hasattr(command, "forms") else [command])
        for parameter in form.params
        for option in parameter.opts
        if "role" in option or parameter.name == "swap"
    }
    assert named == {"--swap-roles"}
