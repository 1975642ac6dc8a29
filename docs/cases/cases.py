"""The cases of the gallery: each compares a problem file of this folder with values from elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.quiver import Quiver
from scipy.optimize import brentq

import verification as vf
from verification.figures import Figure, draw_bodies

HERE = Path(__file__).parent
Floats = np.ndarray

#: Lengths that the problem files have only in their meshes: radius of the rollers and width of half of one.
RADIUS, WIDTH = 10.0, 5.0

#: Width of half the block under the punch.
BED = 20.0

#: Radii of the press fit (inside, between, outside) and by how much the rings overlap.
RINGS, OVERLAP = (10.0, 20.0, 30.0), 0.02

#: The pin: radii of the hub and of the pin, and how much wider the hole is.
HUB, PIN, CLEARANCE = 0.05, 1.0, 0.005


@dataclass(frozen=True)
class Row:
    """A quantity with its value from elsewhere and ours."""

    quantity: str
    known: float
    ours: float

    @property
    def difference(self) -> float:
        return abs(self.ours / self.known - 1)


@cache
def solved(file: str) -> Any:
    """The solution of a file, or the history of one that has steps."""
    problem = vf.load(HERE / f"{file}.toml")
    return vf.march(problem) if problem.steps else vf.solve(problem)


# --- parts of the closed forms ----------------------------------------------------------------------------------------


def moduli(body: Any) -> tuple[float, float]:
    return float(body.young), float(body.poisson)


def plane(body: Any) -> float:
    """E / (1 - nu^2)."""
    young, poisson = moduli(body)
    return young / (1 - poisson**2)


def hertz(force: float, radius: float, modulus: float) -> tuple[float, float]:
    """Half the width of the contact and the largest pressure."""
    return 2 * np.sqrt(force * radius / (np.pi * modulus)), np.sqrt(force * modulus / (np.pi * radius))


def root(x: Floats, end: float) -> Floats:
    """sqrt(1 - x^2/end^2), 0 beyond the end."""
    return np.sqrt(np.maximum(1 - (x / end) ** 2, 0))


def reach(x: Floats, ellipse: Floats) -> float:
    """The end of an ellipse c sqrt(1 - x^2/end^2) from its values: a straight line through their squares over x^2."""
    slope, height = np.polyfit(x**2, ellipse**2, 1)
    return float(np.sqrt(-height / slope))


def partial(x: Floats, a: float, c: float) -> Floats:
    """Shear over k p_0 where the middle of half the width c sticks."""
    return root(x, a) - c / a * root(x, c)


def farthest(values: Floats, known: float) -> float:
    """The value that is farthest from what is known."""
    return float(values[np.argmax(np.abs(values - known))])


# --- the cases: from a problem and its result to rows -----------------------------------------------------------------


def of_cylinder(problem: vf.Problem) -> tuple[float, float]:
    """Half the width of the contact and the largest pressure, from the load."""
    elastic = [body for body in (problem.body1, problem.body2) if not body.rigid]
    force = -2 * WIDTH * float(problem.body2.traction["top"][1])
    return hertz(force, RADIUS, 1 / sum(1 / plane(body) for body in elastic))


def cylinder(problem: vf.Problem, result: Any) -> Iterator[Row]:
    contact, (a, p0) = result.contact, of_cylinder(problem)
    inner = contact.x <= 0.8 * a
    yield Row("largest pressure", p0, contact.pressure.max())
    yield Row("half width of contact", a, reach(contact.x[inner], contact.pressure[inner]))


def pushed(problem: vf.Problem, history: Any, i: int) -> tuple[Any, float, float, float, float]:
    """Fields of an increment, its friction and shear over k P, and half the width and largest pressure by Hertz."""
    contact, k = history.increments[i].contact, float(problem.contact.friction)
    force = contact.force["normal"]
    a, p0 = hertz(force, RADIUS / 2, plane(problem.body1) / 2)
    return contact, k, -contact.force["tangential"] / (k * force), a, p0


def cattaneo(problem: vf.Problem, history: Any) -> Iterator[Row]:
    contact, k, load, a, p0 = pushed(problem, history, 1)
    c = a * np.sqrt(1 - load)
    inner = np.abs(contact.x) <= 0.8 * c
    rest = k * contact.pressure + contact.shear
    yield Row("half width of stick", c, reach(contact.x[inner], rest[inner]))
    yield Row("shear in the middle", k * p0 * (1 - c / a), -np.interp(0, contact.x, contact.shear))


def mindlin(problem: vf.Problem, history: Any) -> Iterator[Row]:
    first, k, most, a, p0 = pushed(problem, history, 1)
    contact, _, load, *_ = pushed(problem, history, 2)
    c, new = a * np.sqrt(1 - most), a * np.sqrt(1 - (most - load) / 2)
    inner = np.abs(contact.x) <= 0.8 * new
    rest = 2 * k * contact.pressure + first.shear - contact.shear
    known = k * p0 * (1 - c / a) - 2 * k * p0 * (1 - new / a)
    yield Row("half width of stick", new, reach(contact.x[inner], rest[inner]))
    yield Row("shear in the middle", known, -np.interp(0, contact.x, contact.shear))


#: Published displacements along x, in mm, at these distances from the left corner.
AT = {"A": (0.0, 2.86e-2), "B": (1.25, 2.72e-2), "C": (5.0, 2.28e-2), "D": (7.5, 1.98e-2), "E": (11.25, 1.50e-2)}


def plate(problem: vf.Problem, result: Any) -> Iterator[Row]:
    for name, (x, known) in AT.items():
        yield Row(f"displacement at {name}", known, -np.interp(x, result.contact.x, result.contact.slip))


def patch(problem: vf.Problem, result: Any) -> Iterator[Row]:
    known = -float(problem.body2.traction["top"][1])
    yield Row("pressure, worst node", known, farthest(result.contact.pressure, known))


def of_punch(problem: vf.Problem, x: Floats) -> Floats:
    """The pressure under a flat punch, P / (pi sqrt(1 - x^2))."""
    return 2 * BED * float(problem.body1.traction["bottom"][1]) / np.pi / np.sqrt(1 - x**2)


def punch(problem: vf.Problem, result: Any) -> Iterator[Row]:
    contact = result.contact
    for i in (0, int(np.argmin(np.abs(contact.x - 0.8)))):
        x = contact.x[i]
        yield Row(f"pressure at x = {x:.2g} mm", float(of_punch(problem, x)), contact.pressure[i])


def of_pin(problem: vf.Problem, angle: Floats) -> Floats:
    """The pressure between a pin and a hole of one material, at angles from the lowest point; b ends the contact."""
    force = -2 * np.pi * HUB * float(problem.body2.traction["left"][1])
    clearance = lambda b: (2 - np.log(b**2 + 1) - 2 * b**4) / (np.pi * (b**2 + 1) * b**2)
    b = brentq(lambda b: clearance(b) - plane(problem.body2) * CLEARANCE / force, 1e-3, 0.9)
    s, r = np.sqrt(b**2 + 1), np.sqrt(np.maximum(b**2 - np.tan(angle / 2) ** 2, 0))
    second = np.log((s + r) / (s - r)) / (2 * np.pi * b**2 * s**2)
    return force / PIN * (2 / (np.pi * s) * r * np.cos(angle / 2) ** 2 + second)


def pin(problem: vf.Problem, result: Any) -> Iterator[Row]:
    contact = result.contact
    angle = contact.s / PIN
    for place, at in (("0 degrees", 0.0), ("30 degrees", np.pi / 6)):
        yield Row(f"pressure at {place}", float(of_pin(problem, at)), np.interp(at, angle, contact.pressure))


def press_fit(problem: vf.Problem, result: Any) -> Iterator[Row]:
    a, b, c = RINGS
    inner, outer = plane(problem.body1), plane(problem.body2)
    nu, mu = (poisson / (1 - poisson) for _, poisson in map(moduli, (problem.body1, problem.body2)))
    shrinks = b / inner * ((b * b + a * a) / (b * b - a * a) - nu)
    known = OVERLAP / (shrinks + b / outer * ((c * c + b * b) / (c * c - b * b) + mu))
    yield Row("pressure, worst node", known, farthest(result.contact.pressure, known))


def in_series(result: Any, shift: float, flexible: float) -> Iterator[Row]:
    yield Row("pressure, worst node", shift / flexible, farthest(result.contact.pressure, shift / flexible))


def stack(problem: vf.Problem, result: Any) -> Iterator[Row]:
    bodies = [body for union in (problem.body1, problem.body2) for body in (union.members or ((0, union),))]
    flexible = sum(float(body.y[1] - body.y[0]) / plane(body) for _, body in bodies)
    (top,) = (body.prescribed["top"] for _, body in bodies if "top" in body.prescribed)
    yield from in_series(result, -float(top[1]), flexible)


def column(problem: vf.Problem, result: Any) -> Iterator[Row]:
    held = lambda young, nu: young * (1 - nu) / ((1 + nu) * (1 - 2 * nu))  # where nothing moves aside
    steel, rubber = (held(*map(float, problem.body2.materials[name])) for name in ("steel", "rubber"))
    flexible = 1 / held(*moduli(problem.body1)) + 2 / steel + 2 / rubber
    yield from in_series(result, -float(problem.body2.prescribed["top"][1]), flexible)


def drag(problem: vf.Problem, history: Any) -> Iterator[Row]:
    force = history.increments[-1].contact.force
    yield Row("shear over normal force", float(problem.contact.friction), -force["tangential"] / force["normal"])


def slope(problem: vf.Problem, history: Any) -> Iterator[Row]:
    x, y = history.increments[-1].contact.to_dict()["force"]["vector"]
    k, tan = float(problem.contact.friction), 0.2
    yield Row("pull over load", (tan + k) / (1 - k * tan), -x / y)


# --- pictures ---------------------------------------------------------------------------------------------------------


def pressure_of(known: Callable[[vf.Problem], tuple[Floats, Floats]], **view: Any) -> Callable[[Any], Figure]:
    """The deformed bodies above the pressure, ours and the one that is known; ``view`` limits what is seen of them."""

    def draw(result: Any) -> Figure:
        figure = result.plot(zoom=not view)
        bodies, width = figure.axes[0], float(np.ptp(figure.axes[0].get_xlim()))
        bodies.set(**view)
        for arrows in bodies.findobj(Quiver):
            arrows.scale *= width / float(np.ptp(bodies.get_xlim()))  # as long as they were in the picture
        return beside(figure.axes[1], *known(result.problem))

    return draw


def shear_after(i: int) -> Callable[[Any], Figure]:
    """The shear of an increment of two cylinders, with the shear that is known."""

    def draw(history: Any) -> Figure:
        _, k, most, a, p0 = pushed(history.problem, history, 1)
        x = np.linspace(-a, a, 201)
        known = partial(x, a, a * np.sqrt(1 - most))
        if i == 2:
            load = pushed(history.problem, history, 2)[2]
            known -= 2 * partial(x, a, a * np.sqrt(1 - (most - load) / 2))
        figure, contact = history.plot("shear", times=[history.increments[i].time]), history.increments[i].contact
        return beside(figure.axes[0], x + np.interp(0, contact.x, contact.s), -k * p0 * known)  # drawn over s

    return draw


def beside(ax: Any, x: Floats, y: Floats) -> Figure:
    """A panel with a further curve; it ends a little beyond it, unless the picture of the bodies has the same axis."""
    ax.plot(x, y, "-.", color="#D55E00", linewidth=1.5, label="closed form", zorder=3)
    if len(ax.get_shared_x_axes().get_siblings(ax)) == 1:
        ax.set_xlim(x[0] - 0.1 * np.ptp(x), x[-1] + 0.1 * np.ptp(x))
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return ax.figure


def ellipse(problem: vf.Problem) -> tuple[Floats, Floats]:
    a, p0 = of_cylinder(problem)
    x = np.linspace(0, a, 101)
    return x, p0 * root(x, a)


def whole(result: Any) -> Figure:
    return result.plot()


def stresses(result: Any) -> Figure:
    return result.plot(stress="mises")


@dataclass(frozen=True)
class Case:
    """A case of the gallery.

    Attributes
    ----------
    source : str
        Where the values come from, in MyST.
    compare : callable
        From a problem and its result to rows.
    draw : callable
        From the result to its picture.
    file : str
        Name of the problem file, without its ending.
    """

    title: str
    source: str
    compare: Callable[[vf.Problem, Any], Iterator[Row]]
    draw: Callable[[Any], Figure]
    file: str

    @property
    def rows(self) -> list[Row]:
        result = solved(self.file)
        return list(self.compare(result.problem, result))

    @property
    def figure(self) -> Figure:
        return self.draw(solved(self.file))

    @property
    def steps(self) -> int | None:
        """Steps of the iteration, of all increments; None for an obstacle, which only the global method takes."""
        result = solved(self.file)
        if isinstance(result, vf.History):
            return sum(each.iterations for each in result.increments)
        if result.problem.body1.rigid or result.problem.body2.rigid:
            return None
        return vf.run(result.problem).iterations


JOHNSON, EQUILIBRIUM, SERIES = "{cite}`Johnson1985`, section ", "equilibrium", "springs in series"
on_block = pressure_of(ellipse, xlim=(-0.3, 2.3), ylim=(-1.0, 1.0))
under_punch = pressure_of(lambda problem: (x := np.linspace(0, 0.995, 200), of_punch(problem, x)))
in_hole = pressure_of(
    lambda problem: (x := np.linspace(0, np.pi / 2, 200), of_pin(problem, x / PIN)), xlim=(-0.3, 2.5), ylim=(-1.8, 1.2)
)
CASES = {
    "hertz": Case("A cylinder on a rigid plane", f"{JOHNSON}4.2", cylinder, pressure_of(ellipse), "hertz"),
    "roller": Case("A roller on a block", f"{JOHNSON}4.2", cylinder, on_block, "roller"),
    "cattaneo": Case("Partial slip", f"{JOHNSON}7.2", cattaneo, shear_after(1), "cattaneo"),
    "mindlin": Case("Partial slip, unloaded", f"{JOHNSON}7.4", mindlin, shear_after(2), "cattaneo"),
    "ssnv128": Case("A plate on a rigid plane", "{cite}`CodeAsterSSNV128`", plate, whole, "ssnv128"),
    "patch": Case("A patch test on half a model", EQUILIBRIUM, patch, whole, "patch"),
    "punch": Case("A flat punch", f"{JOHNSON}2.8", punch, under_punch, "punch"),
    "pin": Case("A pin in a hole", "{cite}`CiavarellaDecuzzi2001`", pin, in_hole, "pin"),
    "press-fit": Case("A press fit", "Lamé's rings", press_fit, whole, "press-fit"),
    "stack": Case("A stack of three plates", SERIES, stack, whole, "stack"),
    "column": Case("A column of two materials", SERIES, column, stresses, "column"),
    "drag": Case("A block that is dragged", "Coulomb's law", drag, whole, "drag"),
    "slope": Case("A sledge on a slope", EQUILIBRIUM, slope, lambda h: draw_bodies(h.increments[-1].run), "slope"),
}


def table() -> str:
    """All rows as a table in MyST."""
    lines = ["| case | quantity | known | ours | difference | source | steps |", "|---|---|---|---|---|---|---|"]
    for name, case in CASES.items():
        steps = "-" if case.steps is None else case.steps
        for i, row in enumerate(case.rows):
            exact = row.difference < 1e-9
            values = [
                row.quantity,
                f"{row.known:.5g}",
                f"{row.ours:.5g}",
                "0" if exact else f"{100 * row.difference:.2f} %",
            ]
            title, source, count = (f"{{ref}}`gallery-{name}`", case.source, steps) if i == 0 else ("", "", "")
            lines.append(f"| {' | '.join(map(str, [title, *values, source, count]))} |")
    return "\n".join(lines)
