"""What the widgets show: formulas and constants of the library, runs made here, and a still picture of each."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from importlib.resources import files
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import eigh

import verification as vf
from builder import equations, questions, scenes, stills
from ndtheory import bounds, energy_norms
from ndtheory.scalar import maximum, minimum
from ndtheory.statements import Statement, proof_of, statements
from verification.exploration.javascript import function
from verification.figures import proof_map, style
from verification.semidefinite import losses


def section5_constants(
    E1: Any, E2: Any, unit: Any, m1: Any, m2: Any, M1: Any, M2: Any, Cs1: Any, Cs2: Any, Ctr: Any
) -> tuple[Any, Any, Any]:
    """m, M and C_K/k in a unit of stress, from the moduli and from what :func:`plane` measures."""
    return minimum(m1 * E1, m2 * E2) / unit, (M1 * E1 + M2 * E2) / unit, maximum(Cs1 * E1, Cs2 * E2) * Ctr / unit


#: The formulas that the widgets call, by their name in JavaScript.
FORMULAS: dict[str, tuple[Callable[..., Any], tuple[str, ...]]] = {
    "predictedFactor": (energy_norms.predicted_factor, ("theta", "rho")),
    "predictedTheta": (energy_norms.predicted_theta, ("rho",)),
    "energyOneMinusSquare": (energy_norms.one_minus_square, ("theta", "rho", "kappa1", "kappa2")),
    "energyEnds": (energy_norms.contraction_ends, ("rho", "kappa1", "kappa2")),
    "energyMultiple": (energy_norms.friction_multiple, ("kappa1", "kappa2")),
    "energyLimit": (energy_norms.friction_limit, ("rho", "kappa1", "kappa2")),
    "readPrinted": (bounds.PRINTED.coercivity, ("m",)),
    "G": (bounds.G, ("x", "m", "M", "CR", "u")),
    "P": (bounds.P, ("x", "m", "M", "CR", "u")),
    "D": (bounds.D, ("x", "m", "M", "CR", "u")),
    "Q": (bounds.Q, ("x", "m", "M", "CR")),
    "C1": (bounds.C1, ("D", "Q")),
    "lowerEnd": (bounds.lower_end, ("P",)),
    "oneMinusH1": (bounds.one_minus_h1, ("theta", "D", "Q")),
    "oneMinusH2": (bounds.one_minus_h2, ("theta", "P")),
    "constants": (section5_constants, ("E1", "E2", "unit", "m1", "m2", "M1", "M2", "Cs1", "Cs2", "Ctr")),
    "lossQuotients": (losses.quotients, ("m", "M", "CR", *losses.Suprema.__annotations__)),
}

#: How the largest values of :class:`verification.semidefinite.losses.Suprema` grow: the powers of the moduli of the
#: contact body and of the Neumann body.
POWERS = {
    "reaction": (2, 0),
    "energy": (1, -1),
    "force": (0, 1),
    "displacement": (0, -1),
    "displacement_dual": (0, -2),
    "force_dual": (0, -1),
}

#: The two bars: stiffness of the contact body, of the Neumann body, and how far the end is moved.
BARS = {"S1": 3.0, "S2": 1.0, "moved": 0.1}

#: The thetas of the runs that are shown step by step, and how many steps of each.
THETAS = tuple(Fraction(n, 20) for n in range(1, 20))
STEPS = 40

#: The problem of the maps of the proof.
SETTING = "Section 6, in MPa"

#: One letter for the state of a contact node.
STICK, SLIP, OPEN = "s", "l", "o"


def javascript() -> str:
    """All formulas as one script."""
    written = [function(name, formula, *arguments) for name, (formula, arguments) in FORMULAS.items()]
    names = ", ".join(FORMULAS)
    return "\n".join(["window.ndFormulas = (() => {", *written, f"return {{ {names} }};", "})();", ""])


@cache
def plane() -> dict[str, float]:
    """The constants of Section 6, the lower body being the Neumann body, per unit of Young's modulus.

    Each is a power of the moduli times a number of the geometry: m^a, M^a and the C_s of a body grow with its modulus,
    rho with that of the contact body over that of the Neumann body, C_s in energy norms as the root of the latter, C_t1
    and C_t2 as one over the root of their body's.
    """
    problem = vf.example("section6")
    even = vf.measure(problem.changed(young=("1", "1")))
    alone = {  # C_s is the larger of two: each counts alone where the other body is soft
        "Cs1": vf.measure(problem.changed(young=("1", "1e-6"))).C_s.value,
        "Cs2": vf.measure(problem.changed(young=("1e-6", "1"))).C_s.value,
    }
    return alone | {
        "m1": even.body1.m.value,
        "m2": even.body2.m.value,
        "M1": even.body1.M.value,
        "M2": even.body2.M.value,
        "CR": even.C_R.value,
        "Ctr": even.C_tr.value,
        "rho": even.rho_max.value,
        "CsEnergy": even.C_s_energy.value,
        "Ct1": even.C_t1.value,
        "Ct2": even.C_t2.value,
        "E2": 20000.0,
    }


def broken() -> dict[str, float]:
    """The friction below which every small theta contracts by the printed proof of Section 6 where some of its steps do
    not lose what they lose: for each set of labels on the way to (5.30), in their order and joined by spaces.

    Without its loss a step is not proved: it has the value found at the problem's own friction.
    """
    found, _ = searched()
    measured = vf.measure(vf.example("section6"))
    m, M, C_R = (getattr(measured, name).value for name in ("m", "M", "C_R"))
    scale = measured.C_s.value * measured.C_tr.value
    unit = next(loss.label for loss in found.friction if loss.only_unit)
    lost = {loss.label: 0.0 if loss.only_unit else loss.decades for loss in found.friction}
    thresholds = {}
    for count in range(len(lost) + 1):
        for labels in combinations(lost, count):
            read, u = (m, m) if unit in labels else (bounds.PRINTED.coercivity(m), 1.0)
            fewer = 10 ** sum(lost[label] for label in labels)
            thresholds[" ".join(labels)] = bounds.inverse_G(fewer * read**3, read, M, C_R, u) / scale
    return thresholds


@cache
def searched() -> tuple[losses.Losses, dict[str, float]]:
    """The losses of Section 6, and the largest values that are eigenvalues, per power of the moduli."""
    problem = vf.example("section6")
    pair, measured = vf.build(problem), vf.measure(problem)
    neumann, contact = (float(body.young) for body in (problem.body1, problem.body2))
    found = losses.locate(pair, measured)
    assert found is not None
    values = vars(losses.suprema(losses.LossForms(pair)))
    return found, {name: values[name] / contact**a / neumann**b for name, (a, b) in POWERS.items()}


def whole_map() -> dict[str, Any]:
    """All that the theorems, propositions and lemmas of the paper lean on."""
    kinds = ("theorem", "proposition", "lemma")
    return _map(list(proof_of([id for id, one in statements().items() if one.kind in kinds])))


def chain() -> dict[str, Any]:
    """The steps that lose something, and how they reach the theorem."""
    return _map(proof_map.CHAIN)


def _map(ids: Collection[str]) -> dict[str, Any]:
    """A map of statements, their texts, and what it takes to find the losses of its steps at other values."""
    found, suprema = searched()
    problem = vf.example("section6")
    return {
        "svg": proof_map.draw_map(ids, losses=found, of=SETTING, grounds=False),
        "nodes": {id: _texts(statements()[id]) for id in ids},
        "steps": {" ".join(edge): step for edge, step in proof_map.STEPS.items()},
        "losses": found.to_dict(),
        "broken": broken(),
        "suprema": {name: [suprema[name], *POWERS[name]] for name in POWERS},
        "exact": losses.EXACT,
        "base": plane(),
        "own": {"ratio": float(problem.body1.young / problem.body2.young), "k": float(problem.contact.friction)},
        "width": proof_map.WIDTH,
        "printed": " ".join(proof_map.PRINTED),
    }


def _texts(statement: Statement) -> dict[str, Any]:
    """What a box shows when it is opened; ``at`` is its place in the index of equations."""
    names = ("title", "verdict", "claims", "wrong", "repair", "proof", "reading", "note")
    texts = {name: text for name in names if (text := getattr(statement, name))}
    return texts | {"name": proof_map.number(statement), "leans": statement.leans_on, "at": equations.anchor(statement)}


def spectrum() -> dict[str, Any]:
    """Section 6 in both roles: eigenvalues of (S_c, S_n), and runs step by step."""
    return {
        "roles": [_role(problem) for problem in section6_in_both_roles()],
        "thetas": [float(theta) for theta in THETAS],
    }


def section6_in_both_roles() -> tuple[vf.Problem, vf.Problem]:
    """A coarse mesh, so that the states of its nodes can be read; the lower body Neumann first."""
    problem = vf.example("section6").changed(cells=((10, 2), (6, 2)), radius="0.2")
    return problem, problem.swapped()


def _role(problem: vf.Problem) -> dict[str, Any]:
    pair = vf.build(problem)
    contact, neumann = (side.schur[np.ix_(side.free, side.free)] for side in (pair.contact, pair.neumann))
    runs = []
    for theta in THETAS:
        states, residuals = [], []
        for iterate, _ in zip(vf.iterate(pair, theta=theta), range(STEPS), strict=False):
            states.append(_states(iterate.contact.pattern))
            residuals.append(float(f"{iterate.relative_residual:.4g}"))
            if residuals[-1] <= 1e-9:
                break
        runs.append({"states": states, "residuals": residuals})
    name = "lower" if problem.iteration.neumann_body == 1 else "upper"
    eigenvalues = eigh(contact, neumann, eigvals_only=True)
    return {"neumann": name, "eigenvalues": [float(f"{value:.12g}") for value in eigenvalues], "runs": runs}


def _states(pattern: Any) -> str:
    return "".join(
        OPEN if not touching else SLIP if sliding else STICK
        for touching, sliding in zip(pattern.touching, pattern.sliding, strict=True)
    )


@dataclass(frozen=True, kw_only=True)
class Widget:
    """A widget.

    Attributes
    ----------
    label : str
        What a screen reader says, and the alternative text of its still picture.
    data : callable
        What it needs beside the formulas.
    still : callable
        Draws its first view, as a figure or as the text of an SVG.
    script : str
        The script that fills it, if it has another name.
    style : str
        A style sheet that it has beside the common one.
    """

    label: str
    data: Callable[[], dict[str, Any]]
    still: Callable[[dict[str, Any]], Any]
    script: str = ""
    style: str = ""


WIDGETS = {
    "cobweb": Widget(
        label="Cobweb of the iteration between two bars, and the V of its two slopes over theta",
        data=lambda: dict(BARS),
        still=stills.cobweb,
    ),
    "plane": Widget(
        label="The plane of theta and friction, with the regions in which each form of the theorem proves contraction",
        data=plane,
        still=stills.plane,
    ),
    "spectrum": Widget(
        label="Eigenvalues of the two bodies under a V, and a run step by step: states of the nodes, residuals",
        data=spectrum,
        still=stills.spectrum,
    ),
    "map": Widget(
        label="Map of the proof: each statement below those that it leans on, with its verdict and what its steps lose",
        data=whole_map,
        still=lambda data: data["svg"],
        style="map.css",
    ),
    "chain": Widget(
        label="Map of the main chain of the proof, with the verdict on each statement and what its steps lose",
        data=chain,
        still=lambda data: data["svg"],
        script="map",
        style="map.css",
    ),
    **{
        page: Widget(label=module.LABEL, data=module.data, still=scenes.still, script="scenes")
        for page, module in ((page, questions.of(page)) for page in (*questions.PAGES, *questions.FURTHER))
    },
}


def write(folder: Path) -> None:
    """Formulas, data and still pictures, for the site to copy."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "formulas.js").write_text(javascript(), encoding="utf-8")
    for name in ("drawing.js", "widgets.css"):
        (folder / name).write_text(files("verification").joinpath("data", name).read_text("utf-8"), encoding="utf-8")
    preview = stills.plane(plane())
    preview.set_size_inches(7.5, 3.9375)  # 1200 x 630 pixels, as links are shown elsewhere
    style.save(preview, folder / "preview.png")
    for name, widget in WIDGETS.items():
        data = widget.data()
        script = f"(window.ndData = window.ndData || {{}}).{name} = {json.dumps(data, separators=(',', ':'))};\n"
        (folder / f"{name}-data.js").write_text(script, encoding="utf-8")
        still, target = widget.still(data), folder / f"{name}.svg"
        if isinstance(still, str):
            target.write_text(still, encoding="utf-8")
        else:
            style.save(still, target)


def scripts(shown: Iterable[str]) -> list[str]:
    """The scripts of a page that shows these widgets, in the order in which they are loaded."""
    names = list(shown)
    own = [f"{name}-data.js" for name in names] + [f"{WIDGETS[name].script or name}.js" for name in names]
    return ["formulas.js", "drawing.js", *dict.fromkeys(own)] if own else []


def styles(shown: Iterable[str]) -> list[str]:
    """The style sheets of a page that shows these widgets."""
    own = [sheet for name in shown for sheet in ("widgets.css", WIDGETS[name].style) if sheet]
    return list(dict.fromkeys(own))


def element(name: str, static: str) -> str:
    """The HTML of a widget: a frame that its script fills, its still picture for paper and where scripts are off.

    Parameters
    ----------
    name : str
    static : str
        The way to the folder of the pictures, from the page.
    """
    still = f'<img class="still" loading="lazy" src="{static}/{name}.svg" alt="{WIDGETS[name].label}">'
    page = f'data-site="{static.removesuffix("_static")}"'
    return f'<figure class="widget" data-widget="{name}" {page} aria-label="{WIDGETS[name].label}">{still}</figure>'
