"""Runs of one problem on a grid in both roles, as a document and as one page of HTML."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from fractions import Fraction
from importlib.resources import files
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ndtheory import __version__
from ndtheory.energy_norms import one_minus_square, predicted_factor, predicted_theta
from ndtheory.keys import derived, key, says
from verification.algorithm.history import History, march
from verification.algorithm.runs import run
from verification.bounds.bound import Region
from verification.constants import measure
from verification.contact import ContactError
from verification.document import Document
from verification.exploration.film import FARTHEST, Film, drawn, film, packed, past, told
from verification.exploration.javascript import function
from verification.interface.build import pair_of
from verification.interface.pair import ContactPair, pair_from
from verification.machine.progress import Progress, silent
from verification.problem import load
from verification.problem.specification import Problem
from verification.problem.specs import PLACES
from verification.problem.steps import at_rest, moments
from verification.problem.tables import ProblemError
from verification.registry import BOUNDS

#: Multiples of the problem's friction that are run; without friction, the frictions themselves.
SHARES = tuple(Fraction(n, 4) for n in (0, 2, 4, 6, 8))
FRICTIONS = tuple(Fraction(n, 10) for n in (0, 1, 2, 4))

#: Thetas of the grid; none is run at a distance below APART from the problem's own or a predicted one.
THETAS, APART = tuple(Fraction(n, 20) for n in range(1, 20)), Fraction(1, 50)

#: The largest theta of the grid in three digits.
CLOSEST_TO_ONE = 0.999

#: The formulas that the page evaluates, by their names in JavaScript.
FORMULAS = (
    ("predictedFactor", predicted_factor, ("theta", "rho")),
    ("energyOneMinusSquare", one_minus_square, ("theta", "rho", "kappa1", "kappa2")),
)


#: What keys of exact numbers share that documents have in doubles.
DOUBLES: dict[str, Any] = {"type": "list of number", "of": lambda values: [float(value) for value in values]}


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Exploration(Document):
    """Runs of one problem at several theta and frictions, in both roles of the bodies; or its loading histories.

    ``own`` are the places of the problem's theta and friction.  ``histories`` are by friction, where the problem has
    steps: the one film then has one theta, and the increments for steps.
    """

    schema: ClassVar[str] = "ndtheory.explore/1"

    problem: Problem
    thetas: tuple[Fraction, ...] = key("the grid; of a problem with steps one theta", name="theta", **DOUBLES)
    frictions: tuple[Fraction, ...] = key("the grid", name="friction", **DOUBLES)
    own: tuple[int, int]
    films: tuple[Film, ...] = key("the roles of the file, and the roles exchanged where that is possible", name="roles")
    why_one_role: str
    histories: tuple[History, ...] = ()

    title = derived("title of the problem", lambda page: page.problem.title)

    @property
    @says("`roles`: why the roles cannot be exchanged")
    def reason(self) -> dict[str, str]:
        return {"roles": self.why_one_role} if self.why_one_role else {}

    @property
    def units(self) -> Any:  # type: ignore[override]
        return self.problem.units

    @property
    def summary(self) -> str:
        count = len(self.films) * len(self.thetas) * len(self.frictions)
        if self.histories:
            return f"{self.problem.title}, {count} loading histories at {len(self.frictions)} frictions"
        return f"{self.problem.title}, {count} runs at {len(self.thetas)} thetas and {len(self.frictions)} frictions"

    def page(self) -> str:
        """Return the page: HTML that loads nothing from other files or hosts."""
        from jinja2 import Environment, PackageLoader, StrictUndefined

        environment = Environment(
            loader=PackageLoader("verification", "data"), autoescape=True, undefined=StrictUndefined
        )
        formulas = "\n".join(function(name, formula, *arguments) for name, formula, arguments in FORMULAS)
        # "<" would let a title end the script
        data = json.dumps(self._data(), separators=(",", ":")).replace("<", "\\u003c")
        text = {name: files("verification").joinpath("data", name).read_text("utf-8") for name in PARTS}
        return environment.get_template("explore.html.j2").render(
            title=self.problem.title, version=__version__, formulas=formulas, data=data, parts=text, found=self
        )

    def _data(self) -> dict[str, Any]:
        """Return what the scripts of the page read."""
        first = self.films[0].pair
        grid = first.contact.grid
        later = [first.under(each.problem) for each in moments(self.problem) if each.time.denominator == 1]
        return {
            "units": dict(self.units),
            "dimension": grid.dimension,
            "theta": [float(theta) for theta in self.thetas],
            "friction": [float(k) for k in self.frictions],
            "own": self.own,
            "tolerance": float(first.settings.tolerance),
            "gap": _gap(first),
            "bodies": [
                drawn(*(getattr(each, name).mesh_body for each in (first, *later))) for name in ("body1", "body2")
            ],
            "roles": [self._role(found) for found in self.films],
            "bounds": [{"name": name, "colour": BOUNDS[name].colour} for name in self._bounds],
            "past": self._past() if self.histories else None,
        }

    def _past(self) -> dict[str, Any]:
        """Return the histories, by friction, and what they have in common."""
        own = self.histories[self.own[1]]
        label, _, axis = own.driven
        name = "x" if self.films[0].pair.contact.grid.normals is None else "s"  # a line of any shape may stand upright
        at = {"positionName": name, "position": getattr(own.increments[0].contact, name).tolist()}
        return {**at, "driven": label, "axis": axis, "planned": own.planned, "told": [*map(told, self.histories)]}

    @property
    def _bounds(self) -> list[str]:
        return list(self.films[0].runs[0].factors)

    def _role(self, found: Film) -> dict[str, Any]:
        energy = found.measured.energy_constants()
        k = float(found.pair.friction)
        rubs = k > 0 and not found.pair.outside
        return {
            "neumann": found.pair.neumann_body,
            "name": PLACES[found.pair.neumann_body],
            "contactNodes": found.pair.contact.grid.n,
            "normals": found.pair.contact.grid.upright.round(6).tolist(),
            "rho": None if energy is None else float(energy.rho),
            "best": None if energy is None else float(predicted_theta(float(energy.rho))),
            "kappa": [float(energy.kappa_1) / k, float(energy.kappa_2) / k] if rubs and energy else None,
            "regions": [_corners(found.regions.get(name)) for name in self._bounds],
            "whyNoRegion": found.why_no_region,
            **packed(found),
        }


#: The scripts and styles of the page, in the folder of data.
PARTS = ("drawing.js", "widgets.css", "explore.js", "explore.css")


def _corners(region: Region | None) -> list[list[float]]:
    """The frictions of a region, each with the ends of its theta; none where the bound has no region."""
    if region is None:
        return []
    return [[float(f"{x:.5g}") for x in (k, *ends)] for k, ends in zip(region.k, region.theta, strict=True)]


def _gap(pair: ContactPair) -> dict[str, Any]:
    """The initial gap, where it is flat: it is then enlarged like displacements, which otherwise stay as they are."""
    gap = pair.interface.gap
    upright = pair.contact.grid.normals is None
    return {"flat": bool(np.ptp(gap) == 0), "size": float(gap[0]), "upright": upright}


def explore(
    problem: Problem | ContactPair | Path | str, path: Path | str | None = None, *, progress: Progress = silent
) -> Exploration:
    """Run a problem on a grid of theta and friction in both roles, and write a page about it.

    Parameters
    ----------
    problem : Problem, ContactPair or path
        Two elastic bodies on meshes.
    path : path, optional
        The page to write, HTML.
    progress : callable
        Called with words and a share.

    Returns
    -------
    Exploration

    Raises
    ------
    ProblemError, HypothesisError
        Bad input: a rigid body, or matrices without a problem.

    Examples
    --------
    >>> from verification.problem.examples import example
    >>> explore(example("two-bars"))
    <Exploration: Two bars, 38 runs at 19 thetas and 1 frictions>
    """
    given = problem if isinstance(problem, Problem | ContactPair) else load(problem)
    whole = given.problem if isinstance(given, ContactPair) else given
    if whole is None:
        raise ProblemError("", "", None, "this pair is made from matrices: needed the meshes of both bodies")
    if whole.several:
        raise whole.refuse("contact", None, "needed one table [contact]: the page shows two bodies")
    found = _histories(given, whole, progress) if whole.steps else _grid(pair_of(given), whole, progress)
    if path is not None:
        Path(path).write_text(found.page(), encoding="utf-8")
    return found


def _grid(pair: ContactPair, problem: Problem, progress: Progress) -> Exploration:
    """Run a problem on the grid of theta and friction."""
    made = run(pair, rule="constant")
    seen = made.iterates[0] if made.outcome == "diverged" else made.last
    farthest = FARTHEST * max(float(np.abs(u).max()) for u in made.traces_at(seen))
    pairs, why = [pair], ""
    try:
        pairs.append(pair.swapped())
    except ValueError as error:
        why = str(error)
    measured = [measure(each) for each in pairs]
    rhos = [one.rho_max for one in measured if one.rho_max is not None]
    first = {made.theta}
    first |= {Fraction(f"{min(float(predicted_theta(rho.value)), CLOSEST_TO_ONE):.3g}") for rho in rhos}
    thetas = tuple(sorted({*first, *(theta for theta in THETAS if all(abs(theta - each) >= APART for each in first))}))
    frictions = _frictions(pair)
    films = [
        film(each, constants, thetas, frictions, farthest, _part(progress, i, len(pairs)))
        for i, (each, constants) in enumerate(zip(pairs, measured, strict=True))
    ]
    return Exploration(
        problem=problem,
        thetas=thetas,
        frictions=frictions,
        own=(thetas.index(made.theta), frictions.index(pair.friction)),
        films=tuple(films),
        why_one_role=why,
    )


def _histories(given: Problem | ContactPair, whole: Problem, progress: Progress) -> Exploration:
    """Follow the steps of a problem at each friction of the grid at which the first increment has a solution."""
    rest = at_rest(whole)
    pair = given if isinstance(given, ContactPair) else pair_from(replace(rest, steps=whole.steps))
    done: dict[Fraction, History] = {}
    frictions = _frictions(pair)
    for i, k in enumerate(frictions):
        progress(f"following the steps at k = {float(k):.3g}", i / len(frictions))
        try:
            done[k] = march(pair.at(friction=k))
        except ContactError:
            if k == pair.friction:
                raise
            continue
        if done[k].interrupted:
            raise KeyboardInterrupt
    own = done[pair.friction]
    runs = tuple((past(each),) for each in done.values())
    assert own.measured is not None
    return Exploration(
        problem=whole,
        thetas=(Fraction(runs[0][0].theta),),
        frictions=tuple(done),
        own=(0, list(done).index(pair.friction)),
        films=(Film(pair=pair.under(rest), measured=own.measured, lines=runs, regions={}, why_no_region=""),),
        why_one_role="a loading history keeps the roles of the file",
        histories=tuple(done.values()),
    )


def _part(progress: Progress, i: int, count: int) -> Progress:
    """The progress of one role of several."""
    return lambda what, share: progress(f"role {i + 1} of {count}: {what}", (i + (share or 0.0)) / count)


def _frictions(pair: ContactPair) -> tuple[Fraction, ...]:
    """The frictions of the grid; only the problem's own where no law of friction is given."""
    if pair.interface.kernel is None:
        return (pair.friction,)
    return tuple(share * pair.friction for share in SHARES) if pair.friction else FRICTIONS
