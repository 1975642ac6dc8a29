"""The paper's constants, measured on the mesh as extremal generalised eigenvalues."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import scipy.sparse as sp
from scipy.linalg import cho_factor, cho_solve

from fem1d2d import largest, largest_sparse, solver
from fem1d2d.mesh import Floats
from ndtheory import Constants, EnergyConstants, Number, evaluate_sharp
from ndtheory.sharp import friction_multiple
from verification.document import Document
from verification.interface.assembly import build
from verification.interface.pair import Body, Pair
from verification.problem.specification import Problem
from verification.progress import Progress, silent
from verification.threads import one_thread

#: The constants of both bodies together, as documents and screens list them.
NAMES = ("m", "M", "C_R", "C_s", "C_tr", "C_tr_half", "C_K", "rho_max", "rho_min", "rho_normal")
ENERGY_NAMES = ("C_s_energy", "C_t1", "C_t2", "kappa_1", "kappa_2")


@dataclass(frozen=True, kw_only=True)
class BodyConstants:
    """Coercivity m^a and continuity M^a of one body (4.1), unit stress, with the residuals of the eigenvalues.

    ``residual_m``, ``residual_M`` are relative; the error of the eigenvalue is of the order of their square.
    """

    m: Number
    M: Number
    nodes: int
    residual_m: float
    residual_M: float

    def to_dict(self) -> dict[str, Any]:
        """The objects ``body1``, ``body2`` of the document."""
        return {"m": self.m.to_dict(), "M": self.M.to_dict(), "nodes": self.nodes}


@dataclass(frozen=True, kw_only=True)
class Measured(Document):
    """The constants of a problem on its mesh; on this mesh they are exact up to rounding.

    On a mesh m is above and M below its continuous value: for the continuous theorem both err on the unsafe side.

    Attributes
    ----------
    body1, body2 : BodyConstants
    m, M : Number
        Smallest m^a, sum of the M^a (4.2); stress.
    C_R : Number or None
        Lift constant, the safe maximum over both bodies' H^1/2 norms; dimensionless.
    C_s, C_tr : Number or None
        Into L2(Gamma_c), as (5.13) uses them.
    C_tr_half : Number or None
        The tangential trace into H^1/2(Gamma_c), as (5.8) prints it.
    C_K : Number or None
        ``k C_s C_tr``; stress.
    rho_max, rho_min : Number or None
        Extremal eigenvalues of (S of the contact body, S of the Neumann body).
    rho_normal : Number or None
        The largest with the tangential components condensed out.
    C_s_energy : Number or None
        ``sup |S sigma_N(w)|_L2 / |w|_a2`` over a2-harmonic w, a2 that of the Neumann body; sqrt(stress/length).
    C_t1, C_t2 : Number or None
        ``sup |v_T|_L2 / |v|_aa`` of the contact body and of the Neumann body; sqrt(length/stress).
    kappa_1, kappa_2 : Number or None
        ``k C_s C_t1`` and ``k C_s C_t2`` of the theorem in energy norms; dimensionless.
    friction : float
        k.
    interface_nodes : int
    reason : mapping
        Why a value is None.
    units : mapping
        Labels ``length`` and ``stress``.
    levels : tuple of Measured
        The same on meshes halved 0, 1, .. times, where that was asked for.
    """

    schema: ClassVar[str] = "ndtheory.constants/1"

    body1: BodyConstants
    body2: BodyConstants
    m: Number
    M: Number
    C_R: Number | None
    C_s: Number | None
    C_tr: Number | None
    C_tr_half: Number | None
    C_K: Number | None
    rho_max: Number | None
    rho_min: Number | None
    rho_normal: Number | None
    C_s_energy: Number | None
    C_t1: Number | None
    C_t2: Number | None
    kappa_1: Number | None
    kappa_2: Number | None
    friction: float
    interface_nodes: int
    reason: Mapping[str, str]
    units: Mapping[str, str]
    levels: tuple[Measured, ...] = ()

    def constants(self) -> Constants | None:
        """What enters the theorem; None where C_R or C_K does not exist."""
        if self.C_R is None or self.C_K is None:
            return None
        friction: dict[str, float] = {"C_K": 0.0}  # without a law of friction
        if self.C_s is not None and self.C_tr is not None:
            friction = {"C_s": self.C_s.value, "C_tr": self.C_tr.value, "k": self.friction}
        C_R = max(self.C_R.value, 1.0)  # C_R >= 1 by definition; two identical bodies reach it up to rounding
        return Constants(m=self.m.value, M=self.M.value, C_R=C_R, **friction)

    def energy_constants(self) -> EnergyConstants | None:
        """What enters the theorem in energy norms; None where rho or the kappas do not exist."""
        if self.rho_max is None or self.rho_normal is None or self.kappa_1 is None or self.kappa_2 is None:
            return None
        return EnergyConstants(
            rho=self.rho_max.value,
            rho_normal=min(self.rho_normal.value, self.rho_max.value),  # equal up to rounding where nothing slides
            kappa_1=self.kappa_1.value,
            kappa_2=self.kappa_2.value,
        )

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
        return Number.of_float(friction_multiple(C_s * C_t1, C_s * C_t2))

    @property
    def friction_limit(self) -> Number | None:
        """The friction below which some theta is proved by the theorem in energy norms; None without a law."""
        constants = self.with_friction(1.0).energy_constants() if self.of_friction else None
        return None if constants is None else evaluate_sharp(constants).friction_limit_multiple

    def with_friction(self, k: float) -> Measured:
        """The same bodies at another friction.

        Raises
        ------
        ValueError
            Friction without a law.
        """
        if k and not self.of_friction:
            raise ValueError(f"friction {k}: needed a law of friction")
        values: dict[str, Any] = {"C_K": Number.of_float(0.0)}
        if self.of_friction and self.C_s is not None and self.C_tr is not None:
            C_s, C_t1, C_t2 = (value.value for value in self.of_friction)
            values["C_K"] = Number.of_float(k * self.C_s.value * self.C_tr.value)
            values |= {"kappa_1": Number.of_float(k * C_s * C_t1), "kappa_2": Number.of_float(k * C_s * C_t2)}
        return replace(self, friction=k, **values)

    def content(self) -> dict[str, Any]:
        numbers = {name: getattr(self, name) for name in (*NAMES, *ENERGY_NAMES)}
        return {
            "body1": self.body1.to_dict(),
            "body2": self.body2.to_dict(),
            **{name: None if number is None else number.to_dict() for name, number in numbers.items()},
            "interface_nodes": self.interface_nodes,
            "reason": dict(self.reason),
            **({"levels": [level.content() for level in self.levels]} if self.levels else {}),
        }


def measure(problem: Problem | Pair, *, refine: int = 0, progress: Progress = silent) -> Measured:
    """Measure the constants of a problem.

    Parameters
    ----------
    problem : Problem or Pair
    refine : int
        With N > 0 the result lists the constants on meshes halved 0 to N times.
    progress : callable
        Told which mesh is measured.

    Raises
    ------
    ProblemError
        A problem that has no bodies facing each other.
    KeyboardInterrupt
        Before the given mesh was measured; later it ends the list, and ``reason["levels"]`` says so.

    Examples
    --------
    >>> bars = {"dimension": 1,
    ...     "body1": {"shape": "interval", "x": [0, 1], "cells": 8, "young": 3, "fixed": ["left"]},
    ...     "body2": {"shape": "interval", "x": [1, 2], "cells": 8, "young": 2, "fixed": ["right"]}}
    >>> round(measure(Problem.from_dict(bars)).rho_max.value, 12)
    1.5
    """
    pair = build(problem) if isinstance(problem, Problem) else problem
    progress("measuring the constants", None)
    with one_thread():
        finer = [pair.problem.refined(level) for level in range(1, refine + 1)]  # refused before any is measured
        result = _measure(pair)
        if refine:
            levels, reason = [result], dict(result.reason)
            try:
                for halvings, halved in enumerate(finer, 1):
                    progress(f"measuring the constants, {halvings} of {refine} halvings", (halvings - 1) / refine)
                    levels.append(_measure(build(halved)))
            except KeyboardInterrupt:
                reason["levels"] = f"interrupted after {len(levels) - 1} of {refine} halvings"
            result = replace(result, levels=tuple(levels), reason=reason)
    return result


def _measure(pair: Pair) -> Measured:
    friction = float(pair.problem.contact.friction)
    body1, body2 = _body(pair.body1), _body(pair.body2)
    m, M = min(body1.m.value, body2.m.value), body1.M.value + body2.M.value
    values: dict[str, float | None] = dict.fromkeys((*NAMES[2:], *ENERGY_NAMES))
    reason: dict[str, str] = {}
    common = pair.body1.unknown
    if not np.array_equal(common, pair.body2.unknown):
        reason = dict.fromkeys(
            values, "the bodies hold different tangential components of Gamma_c: their traces differ"
        )
    else:
        tangential = np.zeros(len(common), dtype=bool)
        tangential[pair.tangential] = True
        values |= _interface(pair, tangential[common])
        if values["C_s"] is None:
            reason |= dict.fromkeys(("C_s", "C_s_energy"), "no friction and no radius: S is not defined")
            values |= {"C_K": 0.0, "kappa_1": 0.0, "kappa_2": 0.0}
    products = (("C_K", "C_s", "C_tr"), ("kappa_1", "C_s_energy", "C_t1"), ("kappa_2", "C_s_energy", "C_t2"))
    for name, first, second in products:
        a, b = values[first], values[second]
        if a is not None and b is not None:
            values[name] = friction * a * b
    numbers: dict[str, Any] = {name: None if v is None else Number.of_float(v) for name, v in values.items()}
    return Measured(
        body1=body1,
        body2=body2,
        m=Number.of_float(m),
        M=Number.of_float(M),
        friction=friction,
        interface_nodes=pair.n,
        reason=reason,
        units=pair.problem.units,
        **numbers,
    )


def _body(body: Body) -> BodyConstants:
    A, H = body.stiffness, body.gram_matrix
    smallest = largest_sparse(H, A, body.solve)  # 1/m, so that products with A^-1 find it
    biggest = largest_sparse(A, H, solver(H), above=body.material.continuity(body.mesh.dimension))
    return BodyConstants(
        m=Number.of_float(1 / smallest.value),
        M=Number.of_float(biggest.value),
        nodes=len(body.mesh.points),
        residual_m=smallest.residual / smallest.value,
        residual_M=biggest.residual / biggest.value,
    )


def lift_gram(body: Body) -> Floats:
    """``N_a = R_a' H_a R_a``: the H1 norm squared of the elastic lift (4.5), on the interface."""
    return on_lifts(body, body.gram_matrix)


def on_lifts(body: Body, matrix: sp.csc_array) -> Floats:
    """``R_a' X R_a``: a symmetric form on the unknowns of a body, evaluated at the lifts of interface vectors."""
    elastic = body.elastic
    inside, interface, lift = elastic.inside, elastic.interface, elastic.lift
    cross = matrix[interface][:, inside] @ lift
    product = matrix[interface][:, interface].toarray() + cross + cross.T + lift.T @ (matrix[inside][:, inside] @ lift)
    return np.asarray((product + product.T) / 2)


def _interface(pair: Pair, tangential: Any) -> dict[str, float | None]:
    """Constants that live on the interface; all matrices on the components that both bodies leave free."""
    bodies = (pair.body1, pair.body2)
    E = [body.gram.schur for body in bodies]
    S = [body.elastic.schur for body in bodies]
    N = [lift_gram(body) for body in bodies]
    top = lambda A, B: largest(A, B).value
    values: dict[str, float | None] = {"C_R": float(np.sqrt(max(top(n, e) for n in N for e in E)))}
    normal = ~tangential
    contact, neumann = (S[0], S[1]) if pair.problem.iteration.neumann_body == 2 else (S[1], S[0])
    if tangential.any():
        columns = np.flatnonzero(pair.body1.unknown[pair.tangential])
        weights = np.zeros(len(tangential))
        weights[tangential] = pair.weights[columns]
        B_T = np.diag(weights)
        kept = [np.where(np.outer(tangential, tangential), e, 0.0) for e in E]
        values["C_tr"] = float(np.sqrt(max(top(B_T, e) for e in E)))
        values["C_tr_half"] = float(np.sqrt(max(min(top(k, e) for k in kept) for e in E)))
        if pair.regularisation is not None:
            Z = [pair.regularisation @ s[normal] for s in S]
            squares = [z.T @ (pair.weights[:, None] * z) for z in Z]
            values["C_s"] = float(np.sqrt(max(top((z + z.T) / 2, e) for z, e in zip(squares, E, strict=True))))
            # sup |S g_N|^2 / g' S_2^-1 g over g = S_2 phi is the largest eigenvalue of S (S_2)_NN S' in the weights
            root = np.sqrt(pair.weights)[:, None] * pair.regularisation
            stress = root @ neumann[np.ix_(normal, normal)] @ root.T
            values["C_s_energy"] = float(np.sqrt(np.linalg.eigvalsh((stress + stress.T) / 2)[-1]))
        values["C_t1"], values["C_t2"] = (float(np.sqrt(top(B_T, s))) for s in (contact, neumann))
    else:
        values |= dict.fromkeys(("C_tr", "C_tr_half", "C_s", "C_s_energy", "C_t1", "C_t2"), 0.0)
    values["rho_max"] = top(contact, neumann)
    values["rho_min"] = 1 / top(neumann, contact)
    values["rho_normal"] = top(_condense_tangential(contact, normal), _condense_tangential(neumann, normal))
    return values


def _condense_tangential(S: Floats, normal: Any) -> Floats:
    """Schur complement of S on the normal components."""
    slide = ~normal
    if not slide.any():
        return S
    cross = S[np.ix_(slide, normal)]
    inner = cho_solve(cho_factor(S[np.ix_(slide, slide)]), cross)
    result = S[np.ix_(normal, normal)] - cross.T @ inner
    return np.asarray((result + result.T) / 2)
