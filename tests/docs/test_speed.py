"""The page on speed shows what the benchmarks have recorded, and nothing else."""

import json
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from shutil import copy
from types import SimpleNamespace

import pytest
from processes import ended, environment, sites
from threadpoolctl import threadpool_info, threadpool_limits

ROOT = Path(__file__).parents[2]
BENCHMARKS = ROOT / "benchmarks"
CONF = """
import runpy
from pathlib import Path

given = runpy.run_path({conf!r})
project, extensions = "speed", ["myst_parser"]
myst_enable_extensions, exclude_patterns = given["myst_enable_extensions"], given["exclude_patterns"]


def setup(app):
    given["speed_page"].write(Path({records!r}), Path(app.srcdir) / "generated" / "speed", "generated/speed")
"""


@pytest.fixture
def bench(monkeypatch):
    """The modules that the benchmarks share."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return SimpleNamespace(**{name: import_module(name) for name in ("timing", "recording", "speed_page")})


def made_up(bench, **changes):
    """Ours grows like n^1.5 and the other like n^0.5 from 4 on; below, ours does not grow."""
    ours, other = {1: 8.0, 4: 8.0, 16: 64.0, 64: 512.0}, {1: 0.5, 4: 1.0, 16: 2.0, 64: 4.0}
    rows = tuple(bench.recording.row(n, [(1e-3 * ours[n], 1e-3 * other[n])], apart=1e-6) for n in ours)
    given = {
        "name": "made_up", "place": 1, "title": "A comparison", "ours": "this", "other": "that", "peer": "the peer",
        "apart": "distance", "size": "unknowns", "since": 4, "wanted": "n^1.3 at most", "rows": rows,
    }  # fmt: skip
    return bench.recording.Record(**given | changes)


def rendered(bench, records, folder):
    bench.speed_page.write(records, folder, "generated/speed")
    return (folder / "tables.md").read_text("utf-8")


def test_the_ratio_is_the_median_of_ours_over_the_other_round_by_round(bench):
    row = bench.recording.row(5, [(6.0, 2.0), (9.0, 1.0), (4.0, 8.0), (8.0, 4.0), (1.0, 4.0)])
    assert (row.ours, row.other, row.ratio, row.rounds) == (6.0, 4.0, 2.0, 5)


def test_the_growth_is_the_power_of_the_size_where_it_is_fitted(bench):
    record = made_up(bench)
    assert record.growth("ours") == pytest.approx(1.5)
    assert record.growth("other") == pytest.approx(0.5)
    assert made_up(bench, since=0).growth("ours") < 1.2
    assert made_up(bench, since=64).growth("ours") is None


def test_a_side_that_is_not_measured_has_no_ratio_and_takes_no_part_in_the_growth(bench):
    without = bench.recording.row(256, [(4.0, None)])
    assert (without.ours, without.other, without.ratio) == (4.0, None, None)
    assert made_up(bench, rows=(*made_up(bench).rows, without)).growth("other") == pytest.approx(0.5)


def test_both_sides_take_turns_on_one_blas_thread_after_a_first_round(bench):
    seen = []

    def call(name):
        threads = {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}
        seen.append((name, threads))

    with threadpool_limits(2, user_api="blas"):
        pairs = bench.timing.in_turn(lambda: call("ours"), lambda: call("other"), rounds=2, calls=2)
    assert len(pairs) == 2
    assert seen == [(name, {1}) for name in ["ours", "ours", "other", "other"] * 3]


def test_the_time_of_a_process_that_was_started_counts(bench):
    busy = "import time\nwhile time.process_time() < 0.3: pass\nprint(time.process_time())"
    spent, answer = bench.timing.timed(lambda: ended(busy))
    assert spent >= float(answer.stdout)


def test_the_page_shows_what_is_recorded(bench, tmp_path):
    bench.recording.report(made_up(bench), tmp_path)
    document = json.loads((tmp_path / "made_up.json").read_text("utf-8"))
    assert document["growth"] == {"ours": pytest.approx(1.5), "other": pytest.approx(0.5)}
    assert [row["ratio"] for row in document["rows"]] == pytest.approx([16, 8, 32, 128])
    page = rendered(bench, tmp_path, tmp_path / "out")
    cells = page.replace("\N{NO-BREAK SPACE}", " ").replace("\N{NON-BREAKING HYPHEN}", "-")
    assert "| 16 | 64.0 ms | 2.00 ms | 32.0 | 1 | 1e-06 |" in cells
    assert "From 4 unknowns on the CPU time grows like $n^{1.50}$ (ours) and $n^{0.50}$ (the peer)." in page
    assert "The aim of this project is $n^{1.3}$ at most." in page
    assert f"{document['date']} with ndtheory {document['version']}: {document['machine']['cpu']}" in page
    [image] = re.findall(r"\((generated/speed/\S+)\)", page)
    assert (tmp_path / "out" / Path(image).name).is_file()


def test_the_figure_has_both_sides_on_logarithmic_axes_with_their_powers(bench):
    [axes] = bench.speed_page.draw(bench.recording.document(made_up(bench))).axes
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    lines = {line.get_label(): list(line.get_ydata()) for line in axes.lines}
    assert lines == {"ours, $n^{1.50}$": [8e-3, 8e-3, 64e-3, 512e-3], "the peer, $n^{0.50}$": [5e-4, 1e-3, 2e-3, 4e-3]}


def test_a_record_without_another_side_has_no_columns_for_one(bench, tmp_path):
    rows = tuple(bench.recording.row(n, [(1e-3 * n, None)]) for n in (100, 1000))
    alone = made_up(bench, other="", peer="", rows=rows, since=0, wanted="")
    bench.recording.report(alone, tmp_path)
    page = rendered(bench, tmp_path, tmp_path / "out").replace("\N{NO-BREAK SPACE}", " ")
    assert "| unknowns | ours | rounds |\n| --: | --: | --: |\n| 100 | 100 ms | 1 |\n| 1,000 | 1.00 s | 1 |" in page
    assert [line for line in page.splitlines() if line.startswith("- ")] == ["- *ours*: this."]
    assert "the CPU time grows like $n^{1.00}$ (ours)." in page
    assert "other:" not in bench.recording.table(alone)
    [axes] = bench.speed_page.draw(bench.recording.document(alone)).axes
    assert [line.get_label() for line in axes.lines] == ["ours, $n^{1.00}$"]


def test_records_of_two_machines_each_name_their_own(bench, tmp_path):
    for place, name, cpu in ((2, "one", "Abacus"), (1, "two", "Slide rule")):
        document = bench.recording.document(made_up(bench, name=name, place=place, title=name))
        document["machine"]["cpu"] = cpu
        (tmp_path / f"{name}.json").write_text(json.dumps(document), encoding="utf-8")
    page = rendered(bench, tmp_path, tmp_path / "out")
    assert page.index("## two") < page.index("Slide rule") < page.index("## one") < page.index("Abacus")


def test_without_a_record_the_page_says_so_with_the_command(bench, tmp_path):
    page = rendered(bench, tmp_path / "none", tmp_path / "out")
    assert "No measurement is recorded" in page
    assert "$ make bench\n" in page
    assert "|" not in page


@pytest.mark.parametrize("text", ['{"schema": "ndtheory.run/1"}', "[]", "{", ""])
def test_a_file_that_is_no_record_is_named(bench, tmp_path, text):
    (tmp_path / "step.json").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=r"^step\.json: .*make bench"):
        bench.speed_page.read(tmp_path)


def test_a_benchmark_records_what_the_page_shows(bench, tmp_path):
    command = [sys.executable, str(BENCHMARKS / "bench_solve.py"), "--largest", "1500", "--record", str(tmp_path)]
    printed = subprocess.run(command, check=True, capture_output=True, text=True, env=environment()).stdout
    document = json.loads((tmp_path / "solve.json").read_text("utf-8"))
    [row] = document["rows"]
    assert 0 < row["size"] <= 1500
    assert min(row["ours"], row["other"], row["ratio"]) > 0
    assert document["machine"]["blas_threads"] == 1
    page = rendered(bench, tmp_path, tmp_path / "out").replace("\N{NO-BREAK SPACE}", " ")
    for text in (bench.recording.shown(row["ours"], "s"), bench.recording.three(row["ratio"])):
        assert text in printed
        assert text in page


def test_the_committed_records_say_what_their_rows_say(bench):
    found = bench.speed_page.read(bench.speed_page.RECORDS)
    assert {"step", "setup", "solve", "command", "bound_program"} <= {record["name"] for record in found}
    known = bench.recording.Record.__dataclass_fields__
    for document in found:
        given = {name: value for name, value in document.items() if name in known}
        rows = tuple(bench.recording.Row(**row) for row in document["rows"])
        record = bench.recording.Record(**given | {"rows": rows})
        assert document["growth"] == {side: pytest.approx(record.growth(side)) for side in ("ours", "other")}
        assert all(row.ratio is None or row.rounds > 1 or row.ratio == row.ours / row.other for row in rows)


def test_no_time_is_typed_on_the_page():
    text = (ROOT / "docs" / "speed.md").read_text("utf-8")
    assert re.findall(r"\d[\d.,]*\s*(?:%|[µm]?s\b|seconds|minutes|times|MB)", text) == []


def test_the_page_is_built_without_a_warning_with_records_and_without(site_tools, tmp_path):
    some = tmp_path / "some"
    some.mkdir()
    for name in ("setup", "sweep"):  # with another side and without; the site itself shows all
        copy(BENCHMARKS / "records" / f"{name}.json", some)
    for name, records in (("recorded", some), ("empty", tmp_path / "none")):
        (tmp_path / name).mkdir()
        conf = CONF.format(conf=str(ROOT / "docs" / "conf.py"), records=str(records))
        (tmp_path / name / "conf.py").write_text(conf, encoding="utf-8")
        (tmp_path / name / "index.md").write_text((ROOT / "docs" / "speed.md").read_text("utf-8"), encoding="utf-8")
    assert sites(tmp_path / "recorded", tmp_path / "empty") == "recorded 0\nempty 0\n"
    for name, recorded in (("recorded", True), ("empty", False)):
        page = (tmp_path / name / "built" / "index.html").read_text("utf-8")
        assert ("<table" in page) == recorded
        assert ("No measurement is recorded" in page) != recorded
