"""`region`: its picture, its screen and its document, and which region lies inside which."""

import itertools
import math
import signal
from xml.etree import ElementTree

import numpy as np
import pytest
from problem_list import SMALL, edited
from strategies import AT_NIGHT

import verification as vf
from ndtheory import PRINTED, REPAIRED, evaluate, evaluate_energy
from verification.bounds import bound as base
from verification.bounds.bound import NotComputed, Subject
from verification.cli.problems import examples
from verification.free_norm.norm import FreeNorm
from verification.registry import BOUNDS
from verification.semidefinite.bound import SemidefiniteBound
from verification.semidefinite.multipliers import QuadraticForms
from verification.sweeps import region as plane
from verification.sweeps import workers

#: A mesh of 20 nodes, the roles such that runs converge, stall and run away.
COARSE = {"body1.cells": "[5, 1]", "body2.cells": "[3, 1]", "contact.radius": "0.5", "iteration.neumann_body": "2"}


@pytest.fixture(scope="module")
def charted(tmp_path_factory):
    """The plane of a coarse mesh, drawn once."""
    file = tmp_path_factory.mktemp("plane") / "problem.toml"
    file.write_text(edited(SMALL, COARSE), encoding="utf-8")
    problem = vf.load(file)
    shares = []
    told = lambda what, share: shares.append(share) if what.startswith("runs") else None
    return file, vf.measure(problem), plane.chart(problem, progress=told), shares


@pytest.fixture
def region(call, charted, monkeypatch):
    """`region` on that plane, as often as one likes."""
    monkeypatch.setattr(plane, "chart", lambda problem, bounds, store, progress: charted[2])
    return lambda *arguments: call("region", charted[0], *arguments)


def test_region_writes_a_picture_with_both_axes_every_edition_and_every_outcome(region, charted, tmp_path):
    answer = region("-o", tmp_path / "plane.svg")
    assert (answer.status, answer.err) == (0, "")
    assert [path.name for path in tmp_path.iterdir()] == ["plane.svg"]
    assert b"<dc:title>ndtheory</dc:title>" in (tmp_path / "plane.svg").read_bytes()
    drawn = ElementTree.parse(tmp_path / "plane.svg").getroot()
    text = "\n".join("".join(element.itertext()).strip() for element in drawn.iter() if element.tag.endswith("}text"))
    assert "relaxation factor theta" in text
    assert "coefficient of friction k" in text
    assert all(f"{name}: k < " in text for name in ("printed (MPa)", "repaired", "energy", "lmi"))
    words = lambda outcome: "run still falling when stopped" if outcome == "limit" else f"run {outcome}"
    assert all(words(outcome) in text for outcome in {point.outcome for point in charted[2].points})
    first = (tmp_path / "plane.svg").read_bytes()
    assert region("-o", tmp_path / "plane.svg").status == 0  # over its own picture
    assert (tmp_path / "plane.svg").read_bytes() == first
    assert region("-o", tmp_path / "plane.png").status == 0
    assert (tmp_path / "plane.png").read_bytes().startswith(b"\x89PNG")
    assert b"Software\x00ndtheory" in (tmp_path / "plane.png").read_bytes()


def test_region_is_about_the_exchanged_roles_where_they_were_asked_for(call, charted, quick, monkeypatch, tmp_path):
    asked = []
    monkeypatch.setattr(plane, "chart", lambda problem, bounds, store, progress: asked.append(problem) or charted[2])
    for words in ((), ("--swap-roles",)):
        assert call("region", charted[0], "-o", tmp_path / "plane.svg", *words).status == 0
    assert [problem.iteration.neumann_body for problem in asked] == [2, 1]


def test_the_screen_of_region_counts_runs_and_gives_each_edition_its_line(region, quick, charted, tmp_path):
    lines = region("-o", tmp_path / "plane.svg").out.splitlines()
    outcomes = [point.outcome for point in charted[2].points]
    assert any(f"{outcomes.count('converged')} converged" in line for line in lines)
    assert any("still falling when stopped after" in line for line in lines)
    head = next(i for i, line in enumerate(lines) if "every small theta: k <" in line and "some theta: k <" in line)
    rows = [line.split() for line in lines[head + 1 : head + 5]]
    assert [row[0] for row in rows] == ["printed", "repaired", "energy", "lmi"]
    assert all(float(every) <= float(some) for _, every, some, _ in rows)  # where every small theta does, some does
    assert "stresses in MPa" in lines[head + 5]
    assert lines[-1].endswith("plane.svg")
    assert [line for line in lines[:-1] if len(line) > 80] == []


def test_the_document_of_region_is_its_plane(region, quick, charted, tmp_path):
    answer = region("-o", tmp_path / "plane.svg", "--json")
    found = answer.document
    assert (answer.status, answer.err, found["schema"]) == (0, "", "ndtheory.region/1")
    assert set(found["regions"]) | set(found["reason"]) == {"printed", "repaired", "energy", "lmi"}
    for drawn in found["regions"].values():
        assert drawn["k"] == sorted(set(drawn["k"]))
        assert all(0 <= low < high <= 1 for low, high in drawn["theta"])
        assert len(drawn["k"]) == len(drawn["theta"]) > 0
    places = {(point["theta"], point["k"]) for point in found["points"]}
    assert len(places) == len(found["points"]) == len(plane.THETAS) * len(plane.FRICTIONS)
    assert {point["outcome"] for point in found["points"]} == {"converged", "limit", "stalled", "diverged"}
    shares = charted[3]
    assert shares == sorted(shares)
    assert 0 <= shares[0] < shares[-1] <= 1


def ends(region, every=1):
    """Points just inside the border of a region, and in its middle."""
    for k, (low, high) in list(zip(region.k, region.theta, strict=True))[::every]:
        for share in (1e-6, 0.5, 1 - 1e-6):
            yield k, low + share * (high - low)


def test_what_a_theorem_contracts_the_next_one_does_where_m_is_at_least_1(charted):
    """In MPa, that is; with m below 1 the printed threshold is the larger one."""
    _, measured, drawn, _ = charted
    assert measured.m.value >= 1
    for k, theta in ends(drawn.regions["printed"], every=9):
        assert evaluate(REPAIRED, measured.with_friction(k).constants(), theta).verdict == "contraction"
    for k, theta in ends(drawn.regions["repaired"], every=9):
        assert evaluate_energy(measured.with_friction(k).energy_constants(), theta).verdict == "contraction"


def test_below_m_equal_to_1_the_printed_region_is_not_inside_the_repaired_one(write):
    measured = vf.measure(vf.load(write(COARSE | {"body1.young": "7e-8", "body2.young": "2e-8"})))
    constants = measured.constants()
    assert measured.m.value < 1
    assert evaluate(PRINTED, constants).C2.value > evaluate(REPAIRED, constants).C2.value


def test_what_the_theorem_in_energy_norms_contracts_the_semidefinite_bound_does(charted):
    _, measured, drawn, _ = charted
    energy, lmi = drawn.regions["energy"], drawn.regions["lmi"]
    assert max(energy.k) < max(lmi.k)
    for k, (low, high) in zip(lmi.k, lmi.theta, strict=True):
        inner = evaluate_energy(measured.with_friction(k).energy_constants()).interval
        assert inner is None or low <= inner[0] < inner[1] <= high * (1 + 1e-9)
    for k, (_, high) in zip(energy.k, energy.theta, strict=True):  # the border falls as friction grows
        assert high <= max((h for q, (_, h) in zip(lmi.k, lmi.theta, strict=True) if q <= k), default=1.0) * (1 + 1e-9)


@pytest.mark.parametrize("neumann_body", ["1", *["2"] * AT_NIGHT])
def test_a_border_is_off_by_at_most_1_percent_between_its_frictions_too(write, neumann_body):
    pair = vf.build(vf.load(write(COARSE | {"iteration.neumann_body": neumann_body})))
    measured, random = vf.measure(pair), np.random.default_rng(1)
    subject = Subject.of(pair, measured)
    for name, bound in BOUNDS.items():
        if bound.on_request and not AT_NIGHT:
            continue
        region = bound.region(subject)
        line = lambda k, end, region=region: np.interp(k, region.k, [ends[end] for ends in region.theta])
        for k in region.k[-1] * random.uniform(0.001, 1, (60 if bound.calculated else 8) if AT_NIGHT else 4):
            if name == "lyapunov":
                ends = (0.0, FreeNorm(pair, measured, friction=k).largest_theta().theta)
            elif name == "lmi":
                ends = (0.0, QuadraticForms(pair, measured, friction=k).largest_theta().value)
            else:
                ends = bound.evaluate(subject.at(k)).interval
            for end, theta in enumerate(ends):
                near = sorted(line(k * share, end) for share in (0.99, 1.0, 1.01))
                moved = near[0] <= theta <= near[-1] and abs(theta - line(k, end)) <= 0.01
                assert moved or line(k, end) == pytest.approx(theta, rel=0.01), (name, k)


def test_the_border_of_a_region_is_where_contraction_ends(charted):
    _, measured, drawn, _ = charted
    for k, (_, high) in list(zip(drawn.regions["energy"].k, drawn.regions["energy"].theta, strict=True))[::5]:
        energy = measured.with_friction(k).energy_constants()
        assert high == 1 or evaluate_energy(energy, min(high * (1 + 1e-6), 1 - 1e-12)).verdict == "no conclusion"
    for name, edition in (("printed", PRINTED), ("repaired", REPAIRED)):
        for k, (_, high) in list(zip(drawn.regions[name].k, drawn.regions[name].theta, strict=True))[::20]:
            constants = measured.with_friction(k).constants()
            assert evaluate(edition, constants, high * (1 + 1e-6)).verdict == "no conclusion"


def test_no_run_inside_a_proved_region_stalls_or_runs_away(charted):
    _, measured, drawn, _ = charted
    proved = 0
    for point in drawn.points:
        energy = evaluate_energy(measured.with_friction(point.k).energy_constants(), point.theta)
        if energy.verdict == "contraction":
            proved += 1
            assert point.outcome in ("converged", "limit"), point
            steps = math.log(1e-9 * (1 - energy.factor.value)) / math.log(energy.factor.value)
            assert point.outcome == "converged" or point.iterations == plane.MOST_STEPS < 2 * steps, point
    assert proved > 0
    assert any(point.outcome in ("stalled", "diverged") for point in drawn.points)


@pytest.mark.parametrize(
    ("edits", "target", "fragments"),
    [
        (None, "plane.pdf", ["-o", "plane.pdf", ".svg or .png"]),
        (None, "plane", ["-o", "plane", ".svg or .png"]),
        (None, "plane.SVG", ["-o", "plane.SVG", ".svg or .png"]),
        (None, ".svg", ["-o", ".svg or .png"]),
        (None, "problem.toml", ["-o", "problem.toml", ".svg or .png"]),
        (None, "missing/plane.svg", ["missing/plane.svg", "folder that exists", "-o"]),
        (None, "problem.toml/plane.svg", ["problem.toml/plane.svg", "folder that exists", "-o"]),
        (None, "foreign.svg", ["foreign.svg", "not written by this program", "-o"]),
        (None, "foreign.png", ["foreign.png", "not written by this program", "-o"]),
        (None, "folder.svg", ["folder.svg", "-o"]),
        ("local law", "plane.svg", ["problem.toml", "local"]),
        ({"contact.law": '"local"', "contact.radius": None, "contact.friction": "0"}, "plane.svg", ["local"]),
        ("held tangentially", "plane.svg", ["problem.toml", "held tangentially"]),
        ("without friction", "plane.svg", ["problem.toml", "contact.radius", "law of friction"]),
        ({"body1.young": "-1"}, "plane.svg", ["problem.toml", "body1.young", "-1"]),
        ({"body2.prescribed": '{ top = ["free", -1] }'}, "plane.svg", ["body2: no region is proved: C_t1 is infinite"]),
    ],
    ids=str,
)
def test_region_refuses_what_it_cannot_draw_before_anything_is_run(
    call, write, tmp_path, monkeypatch, edits, target, fragments
):
    foreign = {"foreign.svg": "<svg>mine</svg>", "foreign.png": "mine, beside ndtheory"}
    for name, text in foreign.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "folder.svg").mkdir()
    file = write(edits)
    before = {path.name for path in tmp_path.iterdir()}
    monkeypatch.setattr(plane, "sweep_grid", None)
    complaint = call("region", file, "-o", tmp_path / target).complaint
    assert [fragment for fragment in fragments if fragment not in complaint] == []
    assert {path.name for path in tmp_path.iterdir()} == before
    assert {name: (tmp_path / name).read_text() for name in foreign} == foreign


def test_region_refuses_two_bars(call, write, tmp_path):
    complaint = call("region", write(text=examples()["two-bars"]), "-o", tmp_path / "plane.svg").complaint
    assert "problem.toml" in complaint
    assert "friction" in complaint


def test_region_needs_the_name_of_a_picture(call, write):
    assert "-o" in call("region", write()).complaint
    assert "-o" in call("region", write(), "-o").complaint
    assert "-o" in call("region", write(), "-o", "").complaint


@pytest.fixture
def short(monkeypatch, quick):
    """Few points on the borders, no semidefinite bound, few runs, no picture: what matters is which are made."""

    def fail(self, subject, progress):
        raise NotComputed("made up")

    monkeypatch.setattr(base, "TRACED", 4)
    monkeypatch.setattr(plane, "THETAS", (0.1, 0.5, 0.9))
    monkeypatch.setattr(plane, "FRICTIONS", (0.1, 1.0))
    monkeypatch.setattr(SemidefiniteBound, "region", fail)


def test_a_bound_without_a_region_says_why(call, short, write, tmp_path):
    found = call("region", write(COARSE), "-o", tmp_path / "plane.svg", "--json").document
    assert "lmi" not in found["regions"]
    assert found["reason"] == {"lmi": "made up"}
    assert "lmi: made up" in call("region", write(COARSE), "-o", tmp_path / "plane.svg").out


@pytest.mark.parametrize("relaxation", ["newton", "momentum"])
def test_region_runs_a_constant_theta_whatever_the_file_says(call, short, write, tmp_path, monkeypatch, relaxation):
    monkeypatch.setattr(plane, "FRICTIONS", (0.1,))
    chosen = COARSE | {"iteration.relaxation": f'"{relaxation}"', "iteration.theta": '"auto"'}
    points = [
        call("region", write(edits), "-o", tmp_path / "plane.svg", "--json").document["points"]
        for edits in (COARSE, chosen)
    ]
    assert points[0] == points[1]
    assert [point["theta"] for point in points[0]] == [0.1, 0.5, 0.9]


@pytest.mark.parametrize("last", [1, 4])
def test_ctrl_c_ends_region(call, short, write, tmp_path, monkeypatch, last):
    row, seen = workers.row, itertools.count(1)

    def interrupted(*args):
        if next(seen) == last:
            signal.raise_signal(signal.SIGINT)
        return row(*args)

    monkeypatch.setattr(workers, "row", interrupted)
    answer = call("region", write(COARSE), "-o", tmp_path / "plane.svg")
    assert answer.status == 130
    assert answer.err.strip().startswith("interrupted")
    assert answer.err.strip().count("\n") == 0
    assert next(seen) == last + 1  # no other run was begun


def test_with_a_store_the_plane_is_drawn_again_without_a_run(call, short, write, tmp_path, monkeypatch):
    arguments = ("region", write(COARSE), "-o", tmp_path / "plane.svg", "--store", tmp_path / "runs.sqlite", "--json")
    first = call(*arguments).document
    monkeypatch.setattr(workers, "row", None)
    assert call(*arguments).document == first
    assert first["points"]
