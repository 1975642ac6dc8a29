"""The command in process: what a user types, and what comes back."""

import json
from contextlib import contextmanager
from dataclasses import dataclass

import pytest
from problem_list import SMALL, edited

from verification import figures
from verification.cli import main, problems

#: Edits that open the file's gap so far that the bodies never meet, or all but meet, that load nothing, that end inside
#: the theorem.
EDITS = {
    "apart": {"contact.gap": "0.1"},
    "all but apart": {"contact.gap": "0.01499999999999995", "iteration.tolerance": "0.5"},
    "unloaded": {"body2.prescribed": "{ top = [0.0, 0.0] }"},
    "inside the theorem": {"contact.friction": "1e-8", "iteration.theta": "1e-4", "iteration.max_iterations": "9"},
    "inside, unloaded": {
        "contact.friction": "1e-8",
        "iteration.theta": "1e-4",
        "body2.prescribed": "{ top = [0.0, 0.0] }",
    },
    "without friction": {"contact.friction": "0", "contact.radius": None},
    "held tangentially": {"body2.prescribed": '{ top = [0.0, -0.015], left = [0.0, "free"] }'},
    "local law": {"contact.law": '"local"', "contact.radius": None},
    "wrong roles": {"iteration.neumann_body": "2"},
    "soft upper body": {"body2.young": "100"},
    "stiff upper body": {"body2.young": "2e10"},
    "below rounding": {"iteration.tolerance": "1e-20"},
}


@dataclass(frozen=True)
class Answer:
    """What a call leaves behind."""

    status: int
    out: str
    err: str

    @property
    def document(self) -> dict:
        """The one JSON document on stdout; every number in it is finite."""

        def refuse(name: str) -> None:
            raise AssertionError(f"{name} in a JSON document")

        assert self.out.startswith("{"), self
        document, end = json.JSONDecoder(parse_constant=refuse).raw_decode(self.out)
        assert self.out[end:] == "\n"
        return document

    @property
    def complaint(self) -> str:
        """The one line of a refusal: status 2, nothing on stdout."""
        assert (self.status, self.out) == (2, ""), self
        assert self.err.count("\n") == 1, self.err
        assert self.err.endswith("\n")
        return self.err[:-1]


@pytest.fixture(autouse=True)
def known(known_bounds):
    """Commands compare the same bodies over and over."""


@pytest.fixture
def call(capsys):
    """``call("run", file, "--json")`` as ``ndtheory run file --json``."""

    def answer(*arguments: object) -> Answer:
        capsys.readouterr()
        status = main([str(argument) for argument in arguments])
        return Answer(status, *capsys.readouterr())

    return answer


@pytest.fixture
def write(tmp_path):
    """Write a problem, the small one, with keys changed by name of `EDITS` or as a dictionary; returns its path."""

    def write(edits: str | dict[str, str | None] | None = None, name: str = "problem.toml", text: str = SMALL):
        path = tmp_path / name
        path.write_text(edited(text, EDITS[edits] if isinstance(edits, str) else edits or {}), encoding="utf-8")
        return path

    return write


@pytest.fixture
def quick(monkeypatch):
    """Figures that cost nothing, where only their files matter."""
    monkeypatch.setattr(figures, "draw_bodies", lambda result: "bodies")
    monkeypatch.setattr(figures, "draw_history", lambda history, view: view)
    monkeypatch.setattr(figures, "draw_residuals", lambda run, bounds=(): "residuals")
    monkeypatch.setattr(figures, "draw_ruler", lambda found: "ruler")
    monkeypatch.setattr(figures, "draw_waterfall", lambda losses, unit: "waterfall")
    monkeypatch.setattr(figures, "draw_region", lambda plane: "region")
    monkeypatch.setattr(
        figures,
        "save",
        lambda figure, path: path.write_bytes(b"<svg><dc:title>ndtheory</dc:title>Software\x00ndtheory</svg>"),
    )


@pytest.fixture
def after(monkeypatch):
    """``after(n, action)``: act once the iteration has shown n states."""

    def arrange(states: int, action) -> None:
        @contextmanager
        def progress(title, tolerance):
            yield lambda state: action() if state.iteration + 1 == states else None

        monkeypatch.setattr(problems, "progress", progress)

    return arrange
