"""The constants of a problem on its mesh, as they were measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

from ndtheory import Constants, EnergyConstants, Number, evaluate_energy, exact
from ndtheory.energy_norms import friction_multiple
from ndtheory.keys import ABSENT, Part, key, says
from ndtheory.number import above, below, weakest
from verification.constants import cells
from verification.document import Document
from verification.problem import Problem

#: Why no friction is the largest one.
NO_LAW = "no law of friction"

#: Why C_t1 is infinite, and m is 0.
SLIDES = "infinite: the contact body can move rigidly along Gamma_c, and its energy does not bound how far"
NO_COERCIVITY = "m = 0: the contact body can move rigidly, held by contact alone"

#: The constants of both bodies together, as documents and screens list them.
NAMES = ("m", "M", "C_R", "C_s", "C_tr", "C_tr_half", "C_K", "rho_max", "rho_min", "rho_normal")
ENERGY_NAMES = ("C_s_energy", "C_t1", "C_t2", "kappa_1", "kappa_2")
ALL_NAMES = (*NAMES, *ENERGY_NAMES)

#: Constants of friction, each k times two others.
PRODUCTS = (("C_K", "C_s", "C_tr"), ("kappa_1", "C_s_energy", "C_t1"), ("kappa_2", "C_s_energy", "C_t2"))

#: Those that a pair made from matrices does not have, and why.
OF_MESHES = ("body1", "body2", "m", "M", "C_R", "C_s", "C_tr", "C_tr_half", "C_K")
FROM_MATRICES = "the pair is made from matrices: needed the meshes of both bodies"


@dataclass(frozen=True, kw_only=True)
class BodyConstants(Part):
    """Coercivity m^a and continuity M^a of one body (4.1); ``cut`` as of its mesh.

    ``residual_m``, ``residual_M`` are relative residuals of the eigenvalues, whose errors are of the order of their
    squares.
    """

    part: ClassVar[str] = "Body constants"

    m: Number = key("coercivity on the mesh; 0, exactly, where the body can move rigidly", unit="stress")
    M: Number = key("continuity on the mesh", unit="stress")
    nodes: int = key("of its mesh")
    residual_m: float
    residual_M: float
    cut: str = ""


_RHO_CELLS = says(
    r"$\rho^*$, $\rho_N^*$: `rho_max` and `rho_normal` of half-planes of the file's cells once halved, the largest "
    "over all waves along Gamma_c and the limit of long ones ({doc}`mesh_spectrum`)",
    null="in 1D, for a pair made from matrices, bodies other than rectangles or held along Gamma_c, and where the "
    "lengths of cells have no ratio of numbers up to 4",
    why=lambda measured: measured.why_no_cells,
)

MATRICES, FRICTIONLESS = "of a pair made from matrices", "without a law of friction"
LARGE = "above 2000 contact nodes"
DENSE, SMOOTHED = f"{MATRICES}, and {LARGE}", f"{FRICTIONLESS}, and {LARGE}"
APART = f"{LARGE} where the bodies hold different components of them"
KAPPA = "$k C_s C_{t1}$ and $k C_s C_{t2}$ with the largest $k$"
NO_KAPPA = f"with friction {LARGE}, `kappa_1` also where $C_{{t1}}$ is infinite"


@dataclass(frozen=True, kw_only=True, repr=False)
class Measured(Document):
    """The constants of a problem on its mesh; on this mesh they are exact up to rounding.

    On a mesh m is above and M below its continuous value: for the continuous theorem both err on the unsafe side.  C_R
    is the safe maximum over both bodies' H^1/2 norms.  Where friction varies along Gamma_c, k is the largest one and S
    stands for ``k(s) S / max k`` in all constants.  C_s in energy norms is ``sup |S sigma_N(w)|_L2 / |w|_a2`` over
    a2-harmonic w, a2 being the Neumann body's; C_t1 and C_t2 are ``sup |v_T|_L2 / |v|_aa``.
    """

    schema: ClassVar[str] = "ndtheory.constants/1"
    part: ClassVar[str] = "Constants"

    body1: BodyConstants | None = key(null=MATRICES)
    body2: BodyConstants | None = key(null=MATRICES)
    m: Number | None = key(
        "the smaller coercivity, 0 where only contact holds the contact body", unit="stress", null=MATRICES
    )
    M: Number | None = key("the sum of the continuity constants (4.2)", unit="stress", null=MATRICES)
    C_R: Number | None = key("lift constant", null=DENSE)
    C_s: Number | None = key(
        r"of $S\sigma_N$ into $L^2(\Gamma_c)$ (5.13), of $k_jS\sigma_N/\max k$ where k varies",
        unit="stress/√length",
        null=SMOOTHED,
    )
    C_tr: Number | None = key(r"of the tangential trace into $L^2(\Gamma_c)$ (5.13)", unit="√length", null=DENSE)
    C_tr_half: Number | None = key(r"the same into $H^{1/2}(\Gamma_c)$, as (5.8) prints it", null=DENSE)
    C_K: Number | None = key("$k C_s C_{tr}$", unit="stress", null=f"{MATRICES}, and with friction {LARGE}")
    rho_max: Number | None = key(
        r"$\rho$: the largest ratio of the stiffness of the contact body to the stiffness of the Neumann body",
        null=APART,
    )
    rho_min: Number | None = key(
        "the smallest such ratio; 0 where the Neumann grid has more nodes than the contact grid, or only contact holds "
        "the contact body",
        null=APART,
    )
    rho_normal: Number | None = key("the largest without tangential forces", null=APART)
    C_s_energy: Number | None = key("`C_s` in energy norms", unit="√(stress/length)", null=SMOOTHED)
    C_t1: Number | None = key(
        "of the tangential trace of the contact body in energy norms",
        unit="√(length/stress)",
        null=f"{LARGE}, also where it is infinite: only contact holds the contact body, and a rigid motion of it is "
        r"tangential on $\Gamma_c$",
    )
    C_t2: Number | None = key(
        "of the tangential trace of the Neumann body in energy norms", unit="√(length/stress)", null=LARGE
    )
    kappa_1: Number | None = key(KAPPA, null=NO_KAPPA)
    kappa_2: Number | None = key(KAPPA, null=NO_KAPPA)
    friction: float
    interface_nodes: int = key("contact nodes")
    reason: Mapping[str, str]
    units: Mapping[str, str]
    levels: tuple[Measured, ...] = key(
        "the same on meshes halved 0, 1, .. times",
        absent="without `--refine`",
        of=lambda levels: levels or ABSENT,
        default=(),
    )
    problem: Problem | None = None
    unverified: Mapping[str, str] | None = None

    @property
    def summary(self) -> str:
        shown = {"rho": self.rho_max, "m": self.m, "M": self.M, "C_R": self.C_R}
        return ", ".join(f"{name} = {value.value:.4g}" for name, value in shown.items() if value is not None)

    @property
    def nodes(self) -> int | None:
        """Nodes of both bodies; None where only matrices are known."""
        return None if self.body1 is None or self.body2 is None else self.body1.nodes + self.body2.nodes

    @property
    def cuts(self) -> tuple[str, ...]:
        """The cells of mesh files that were cut into triangles, in words."""
        return tuple(body.cut for body in (self.body1, self.body2) if body is not None)

    @cached_property
    def _of_cells(self) -> cells.OfCells:
        return cells.rho_of_cells(self.problem, verified=self.unverified is not None)

    @property
    @_RHO_CELLS
    def rho_cells(self) -> Number | None:
        """The largest ratio of stiffness of waves on half-planes of these cells."""
        return self._of_cells.numbers.get("rho_cells")

    @property
    @_RHO_CELLS
    def rho_normal_cells(self) -> Number | None:
        """The same with the tangential components condensed out."""
        return self._of_cells.numbers.get("rho_normal_cells")

    @property
    def why_no_cells(self) -> str:
        """Why there are none; empty where there are."""
        return self._of_cells.why

    def constants(self) -> Constants | None:
        """The constants of Section 5; None where C_R or C_K does not exist, or m is 0."""
        if self.m is None or self.M is None or self.C_R is None or self.C_K is None or not self.m.value:
            return None
        friction: dict[str, Any] = {"C_K": 0}  # without a law of friction
        if self.C_s is not None and self.C_tr is not None:
            k = exact(self.friction) if self.problem is None else self.problem.contact.friction  # which may be 1/3
            friction = {"C_s": self.C_s, "C_tr": self.C_tr, "k": k}
        # C_R >= 1 by definition; two identical bodies reach it up to rounding
        C_R = self.C_R if self.C_R.value >= 1 else Number.of_float(1.0)
        return Constants(m=self.m, M=self.M, C_R=C_R, **friction)

    def energy_constants(self) -> EnergyConstants | None:
        """The constants of the theorem in energy norms; None where rho or the kappas do not exist."""
        if self.rho_max is None or self.rho_normal is None or self.kappa_1 is None or self.kappa_2 is None:
            return None
        return EnergyConstants(
            rho=self.rho_max,
            # equal up to rounding where nothing slides; 0 where the normal forces follow from the loads
            rho_normal=self.rho_normal if 0 < self.rho_normal.value <= self.rho_max.value else self.rho_max,
            kappa_1=self.kappa_1,
            kappa_2=self.kappa_2,
        )

    @property
    def why_no_constants(self) -> str:
        """Why the theorem of Section 5 has no constants."""
        if self.m is not None and not self.m.value:
            return f"{NO_COERCIVITY}: needed m > 0"
        return next(iter(self.reason.values()), "")

    @property
    def why_no_energy(self) -> str:
        """Why the theorem in energy norms has no constants."""
        return self.reason.get("kappa_1") or next(iter(self.reason.values()), "")

    @property
    def why_no_threshold(self) -> str:
        """Why no friction is the largest one allowed."""
        return f"C_t1 is {SLIDES}" if self.reason.get("C_t1") == SLIDES else NO_LAW

    @property
    def of_friction(self) -> tuple[Number, ...]:
        """C_s, C_t1, C_t2 of the theorem in energy norms; empty without a law of friction."""
        values = [value for value in (self.C_s_energy, self.C_t1, self.C_t2) if value is not None and value.value > 0]
        return tuple(values) if len(values) == 3 else ()

    @property
    def friction_threshold(self) -> Number | None:
        """The friction below which every small theta is proved by the theorem in energy norms; None without a law."""
        if not self.of_friction:
            return None
        C_s, C_t1, C_t2 = (value.value for value in self.of_friction)
        if weakest(value.level for value in self.of_friction) == "float":
            return Number.of_float(friction_multiple(C_s * C_t1, C_s * C_t2))
        constants = self.with_friction(1.0).energy_constants()
        return None if constants is None else evaluate_energy(constants).friction_multiple

    @property
    def friction_limit(self) -> Number | None:
        """The friction below which some theta is proved by the theorem in energy norms; None without a law."""
        constants = self.with_friction(1.0).energy_constants() if self.of_friction else None
        return None if constants is None else evaluate_energy(constants).friction_limit_multiple

    def with_friction(self, k: float) -> Measured:
        """The same bodies at another friction.

        Raises
        ------
        ValueError
            Friction without a law.
        """
        if k and not self.of_friction:
            why = self.why_no_threshold
            raise ValueError(f"friction {k}: " + ("needed a law of friction" if why.startswith("no ") else why))
        values: dict[str, Any] = {}
        if self.C_K is not None:
            C_s, C_tr = self.C_s, self.C_tr  # None without a law of friction
            values["C_K"] = Number.of_float(0.0) if C_s is None or C_tr is None else product(exact(k), C_s, C_tr)
        if self.of_friction:
            c_s, C_t1, C_t2 = self.of_friction
            values |= {"kappa_1": product(exact(k), c_s, C_t1), "kappa_2": product(exact(k), c_s, C_t2)}
        return replace(self, friction=k, problem=None, **values)

    @property
    @says(name="unverified", absent="without `--verified`")
    def not_proved(self) -> dict[str, str] | None:
        """Why a constant has no proved bounds."""
        if self.unverified is None:
            return None
        of_cells = [name for name, number in self._of_cells.numbers.items() if number.level == "float"]
        return dict(self.unverified) | dict.fromkeys(of_cells, self._of_cells.unverified)


def product(k: Fraction, a: Number, b: Number) -> Number:
    """``k a b`` of numbers >= 0 with its enclosure: each end that both have, rounded outwards."""
    value = float(k) * a.value * b.value
    low = None if a.lo is None or b.lo is None else below(k * Fraction(a.lo) * Fraction(b.lo))
    high = None if a.hi is None or b.hi is None else above(k * Fraction(a.hi) * Fraction(b.hi))
    if low is None and high is None:
        return Number.of_float(value)
    return Number.within(value, low, high, weakest([a.level, b.level, "exact" if low == high else "verified"]))
