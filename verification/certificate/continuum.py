"""What the theorem in energy norms says of the bodies of a problem file themselves, not of a mesh.

The mesh of the file enters no bound; its rho is shown beside the continuum's.  What is needed of the file is checked
here and told in one line; what the theory cannot prove for it is null, with its reason.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

from ndtheory import EnergyBounds, Number
from ndtheory.continuum import (
    ContinuumConstants,
    Rectangle,
    TwoRectangles,
    continuum_constants,
    friction_threshold,
    lower,
    statement,
    upper,
)
from ndtheory.intervals import Interval
from ndtheory.moduli import Moduli, half_planes
from verification.certificate.file_mesh import FileMesh, file_mesh
from verification.document import Document
from verification.problem import Problem, ProblemError
from verification.progress import Progress, silent

#: Radius of the kernel where there is no friction, and C_s plays no part.
ANY_RADIUS = Fraction(1)

#: What no number here speaks of.
NOT_CLAIMED = (
    "contraction on a mesh, which may need a smaller theta for good, however fine it is; the local Coulomb law, other"
    " kernels than the hat, unloading, rounding and discretisation errors of a run; that the iteration diverges at a"
    " larger friction or theta"
)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ContinuumCertificate(Document):
    """Bounds that are guaranteed for the continuum.

    Attributes
    ----------
    problem : Problem
    constants : ContinuumConstants
    energy : EnergyBounds or None
        The theorem for the upper bounds of the constants; None where rho is not bounded.
    mesh : FileMesh
        rho on the mesh of the file, in doubles, which may be larger than the continuum's.
    """

    schema: ClassVar[str] = "ndtheory.certificate/1"

    problem: Problem
    constants: ContinuumConstants
    energy: EnergyBounds | None
    mesh: FileMesh

    @property
    def units(self) -> Mapping[str, str]:  # type: ignore[override]
        return dict(self.problem.units)

    @property
    def friction(self) -> Fraction:
        """k."""
        return self.problem.contact.friction

    @property
    def contracts(self) -> bool:
        """Whether contraction is proved at the theta of the file; with ``auto`` at some theta."""
        if self.energy is None:
            return False
        return (
            self.energy.verdict == "contraction" if self.energy.theta is not None else self.energy.interval is not None
        )

    @property
    def theta_judged(self) -> float | None:
        """The theta of the file; with ``auto`` the best one that is proved, None where there is none."""
        theta = self.problem.iteration.theta
        if theta != "auto":
            return float(theta)
        return None if self.energy is None else self.energy.theta_proved

    @property
    def solvable(self) -> bool:
        """Whether every small theta is proved to contract, so that (P1) has exactly one solution."""
        threshold = friction_threshold(self.constants).lo
        assert threshold is not None
        return self.friction < Fraction(threshold)

    @property
    def _interval(self) -> list[float] | None:
        if self.energy is None or self.energy.interval is None or self.energy.theta_max_proved is None:
            return None
        lo, hi = self.energy.interval[0], self.energy.theta_max_proved.lo
        return None if hi is None else [math.nextafter(lo, 1.0) if lo else lo, hi]

    @property
    def summary(self) -> str:
        said = friction_threshold(self.constants)
        return f"{self.problem.title}, continuum: every small theta contracts for k < {said.lo:.4g}"

    def content(self) -> dict[str, Any]:
        c, k, energy = self.constants, self.friction, self.energy
        kappas = c.kappa(k)
        limit = None if energy is None or energy.friction_limit_multiple is None else energy.friction_limit_multiple.lo
        reason = dict(c.reason)
        if energy is None:
            reason |= dict.fromkeys(OF_ENERGY, c.reason.get("rho", ""))
        else:
            none = {name: why for name, why in energy.reason.items() if name in OF_ENERGY}
            reason |= none | ({"friction_limit": "no friction"} if limit is None else {})
        proved = {} if energy is None else {name: getattr(energy, name) for name in OF_ENERGY if hasattr(energy, name)}

        def one(value: Fraction | None) -> dict[str, Any] | None:
            return None if value is None else upper(value).to_dict()

        def of(name: str, side: Any) -> dict[str, Any] | None:
            number = proved.get(name)
            if not isinstance(number, Number):
                return None
            end = number.hi if side is upper else number.lo
            return side(Fraction(end)).to_dict() if end is not None else None

        moduli = [Moduli(young=body.young, poisson=body.poisson) for body in bodies(self.problem)]
        return {
            "kind": "continuum",
            "constants": {
                "C_s": upper(Fraction(Interval.of(c.C_s_square).sqrt().hi)).to_dict(),
                "C_t1": upper(Fraction(Interval.of(c.C_t1_square).sqrt().hi)).to_dict(),
                "C_t2": upper(Fraction(Interval.of(c.C_t2_square).sqrt().hi)).to_dict(),
                "segments": [str(value) for value in c.segments],
                "strips": one(c.strips),
                "cut_off": one(c.cut_off),
                "rho": one(c.rho),
                "rho_least": lower(half_planes(*moduli).high).to_dict(),
                "rho_ends": lower(c.rho_ends).to_dict(),
                "rho_normal": one(c.rho_normal),
                "kappa_1": one(kappas[0]),
                "kappa_2": one(kappas[1]),
            },
            "friction": float(k),
            "friction_threshold": friction_threshold(c).to_dict(),
            "friction_limit": None if limit is None else lower(k * Fraction(limit)).to_dict(),
            "theta": proved.get("theta"),
            "solvable": self.solvable,
            "interval": self._interval,
            "theta_max_proved": of("theta_max_proved", lower),
            "theta_proved": proved.get("theta_proved"),
            "factor_proved": of("factor_proved", upper),
            "factor": of("factor", upper),
            "verdict": "contraction" if self.contracts else "no conclusion",
            "mesh": self.mesh.to_dict(self.theta_judged),
            "not_claimed": NOT_CLAIMED,
            "reason": reason,
        }


#: What of the theorem needs a bound of rho.
OF_ENERGY = (
    "interval", "theta_max_proved", "theta_proved", "factor_proved", "factor", "theta", "friction_limit"
)  # fmt: skip


def bodies(problem: Problem) -> tuple[Any, Any]:
    """The contact body and the Neumann body of a problem."""
    pair = (problem.body1, problem.body2)
    return pair if problem.contact_body == 1 else (pair[1], pair[0])


def two_rectangles(problem: Problem) -> TwoRectangles:
    """The bodies of a problem, where the theory of this page speaks of them.

    Raises
    ------
    ProblemError
        Naming what stands against it.
    """

    def refuse(key: str, value: Any, needed: str) -> ProblemError:
        return ProblemError(problem.source, key, value, f"{needed} (for the continuum)")

    if problem.dimension != 2:
        raise refuse("dimension", problem.dimension, "needed 2")
    law, friction = problem.contact.law, problem.contact.friction
    if friction and law != "nonlocal":
        raise refuse("contact.law", law, 'needed "nonlocal": the theorem does not speak of the local law')
    found = {}
    for name, outer in (("body1", "bottom"), ("body2", "top")):
        body = getattr(problem, name)
        if body.shape != "rectangle":
            raise refuse(f"{name}.shape", body.shape, 'needed "rectangle"')
        held = {*body.fixed, *body.prescribed}
        if held != {outer}:
            raise refuse(f"{name}.fixed", sorted(held), f'needed a body held at "{outer}" alone, fixed or prescribed')
        if None in body.prescribed.get(outer, ()):
            raise refuse(f"{name}.prescribed.{outer}", "free", "needed both components")
        if not body.poisson < Fraction(1, 2):
            raise refuse(f"{name}.poisson", body.poisson, "needed poisson < 1/2")
        found[name] = Rectangle(
            left=body.x[0],
            right=body.x[1],
            thickness=body.y[1] - body.y[0],
            body=Moduli(young=body.young, poisson=body.poisson),
        )
    lower_body, upper_body = found["body1"], found["body2"]
    overlap = (max(lower_body.left, upper_body.left), min(lower_body.right, upper_body.right))
    contact, neumann = (upper_body, lower_body) if problem.contact_body == 2 else (lower_body, upper_body)
    return TwoRectangles(
        contact=contact,
        neumann=neumann,
        interval=problem.contact.interval or overlap,
        radius=problem.contact.radius or ANY_RADIUS,
    )


def certify_continuum(problem: Problem, progress: Progress = silent) -> ContinuumCertificate:
    """What is proved of contraction for two rectangles in the continuum.

    Parameters
    ----------
    problem : Problem
        Two rectangles held only at their outer sides, with the non-local law.  Its mesh enters no bound.
    progress : Progress

    Returns
    -------
    ContinuumCertificate
        For the theta of the problem; where that is ``auto`` for no single theta.

    Raises
    ------
    ProblemError
        The theory does not speak of these bodies.
    """
    model = two_rectangles(problem)
    progress("bounding the constants of the continuum", None)
    constants = continuum_constants(model)
    theta = problem.iteration.theta
    friction = problem.contact.friction
    energy = statement(constants, friction=friction, theta=None if theta == "auto" else theta)
    mesh = file_mesh(problem, progress)
    return ContinuumCertificate(problem=problem, constants=constants, energy=energy, mesh=mesh)
