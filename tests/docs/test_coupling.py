"""The page of advice for couplings: its commands run, it names the sources of its keys, and the index leads to it."""

import json
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
from coupling_logs import linear_run, precice

import verification as vf
from verification.cli import main
from verification.coupling.snippets import SNIPPETS

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "coupling.md").read_text("utf-8")
CONSOLE = re.findall(r"```console\n(.*?)```", PAGE, flags=re.S)
COMMANDS = [line.removeprefix("$ ndtheory ") for block in CONSOLE for line in block.splitlines()]


@pytest.fixture
def folder(tmp_path, monkeypatch, capsys):
    """A folder with the files that the page speaks of."""
    monkeypatch.chdir(tmp_path)
    assert main(["example", "section6"]) == 0
    Path("my.toml").write_text(capsys.readouterr().out, encoding="utf-8")
    for name, values in (("a", [3.0, 2.0]), ("b", [1.0, 4.0])):
        np.savez(f"{name}.npz", np.diag(values))
    X = np.random.default_rng(1).normal(size=(5, 2))
    np.save("X.npy", X)
    np.save("TX.npy", 1 - X * (0.5, 2.0))
    for name, theta in (("precice-Solid-convergence", 0.5), ("a", 0.3), ("b", 0.6)):
        precice(Path(f"{name}.log"), [{"ResAbs(Mesh:Force)": linear_run((0.2, 1.1), theta, 60)[0]}])
    residuals, _ = linear_run((0.2, 1.1), 0.5, 30)
    Path("out.txt").write_text("".join(f"residual = {r:.8e}\n" for r in residuals), encoding="utf-8")
    lines = []
    for k, residual in enumerate(residuals[:8], 1):  # by a fixed factor
        lines += [f"Time = 1, iteration: {k}", "Current fsi under-relaxation factor (fixed): 0.5"]
        lines.append(f"Current fsi relative residual norm: {residual / residuals[0]:.6g}")
    turning = 0.9 ** np.arange(40) * np.abs([np.cos(np.arange(40)), np.sin(np.arange(40))])
    precice(Path("both.log"), [{f"ResAbs(Mesh:{name})": field for name, field in zip("FU", turning, strict=True)}])
    rows = [f"0,{n},{np.log10(r)}" for n, r in enumerate(residuals)]
    Path("history.csv").write_text("Time_Iter,Outer_Iter,bgs[P][0]\n" + "\n".join(rows) + "\n", encoding="utf-8")
    Path("log.solids4Foam").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return tmp_path


def test_every_line_of_a_console_is_a_command_of_this_project():
    assert len(COMMANDS) > 8
    assert all(line.startswith("$ ndtheory ") for block in CONSOLE for line in block.splitlines())
    assert {"--tied", "--snippets", "--log", "--S1"} <= set(" ".join(COMMANDS).split())


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_on_the_page_runs(folder, capsys, command):
    words = shlex.split(command.partition(" > ")[0])
    assert main(words) == 0
    assert capsys.readouterr().out


def test_the_script_of_the_page_makes_files_that_the_command_reads_of_what_Kratos_wrote(tmp_path, monkeypatch, capsys):
    """Six iterations of Aitken in Kratos 10.4.4: plates tied on 13 nodes, the Neumann problem on the upper one."""
    shutil.copytree(DOCS.parent / "tests" / "verification" / "kratos_logs" / "vectors", tmp_path / "vectors")
    monkeypatch.chdir(tmp_path)
    script = re.search(r"```python\n(import meshio\n.*?)```", PAGE, re.S)[1]
    exec(compile(script, "page", "exec"), {})
    assert np.load("X.npy").shape == np.load("TX.npy").shape == (6, 26)
    tied = {line for line in COMMANDS if line.startswith("advise vectors") and "--tied" in line}
    (command,) = {line for line in tied if "--parallel" not in line}
    assert main([*shlex.split(command), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    problem = vf.example("section6").changed(cells=((20, 3), (12, 3)), neumann_body=2)
    own = vf.advise(problem, tied=True).roles[0]
    assert found["spectrum"]["high"] == pytest.approx(own.rho_tied.value, rel=0.05)
    assert found["theta"] == pytest.approx(own.theta_tied, rel=0.2)
    assert found["theta"] * (1 + own.rho_tied.value) < 2
    assert (found["method"]["name"], found["method"]["exchanged"]) == ("constant", True)  # 7 steps against 18


def test_the_page_names_each_library_with_the_sources_of_its_keys():
    table = {line.split("]")[0].removeprefix("| [").rstrip(): line for line in PAGE.splitlines() if "| [" in line}
    assert {name.removesuffix(".jl") for name in table} == set(SNIPPETS)
    assert all(re.search(r"`[\w/]+\.(cpp|py|jl)`", line) for line in table.values())
    assert re.search(r"<!-- The keys were read in: .*commit \w{8}.* -->", PAGE, flags=re.S)


def test_the_index_leads_to_the_page():
    index = (DOCS / "index.md").read_text("utf-8")
    assert "{doc}`coupling`" in index
    assert "<coupling>\n" in index
