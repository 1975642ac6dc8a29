"""Advice from a problem file or two bodies: the stiffness of both on the interface."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.linalg import eigh

from ndtheory import Number
from verification.algorithm.theta import automatic, by_prediction, energy_bounds
from verification.constants import measure
from verification.constants.measuring import normal_pencil, pencil
from verification.constants.operators import Pencils, needs_matrices, pair_or_bodies
from verification.coupling.advice import Advice
from verification.coupling.cells import suggest
from verification.coupling.evidence import Evidence
from verification.coupling.kinds import kind_of
from verification.coupling.layers import RoleOfLayers, of_layers
from verification.coupling.roles import Role, plain_role, role_of, with_both_ends
from verification.coupling.spectrum import Spectrum
from verification.interface.assembly import SingularRole, TwoBodies
from verification.interface.build import build
from verification.interface.pair import ContactPair
from verification.machine.progress import Progress, silent
from verification.machine.threads import one_thread
from verification.problem import Problem, load
from verification.problem.tables import ProblemError

#: Up to so many unknowns all eigenvalues are found, for the predictions of methods; beyond only their ends.
ALL = 600


@dataclass(frozen=True, kw_only=True)
class FromProblem(Evidence):
    """A problem file, or two bodies, and the ``roles`` as they were measured."""

    roles: tuple[Role, ...]

    def spectra(self) -> tuple[Role, ...]:
        """The file's assignment first."""
        return self.roles

    @cached_property
    def layers(self) -> tuple[RoleOfLayers, ...]:
        """For a problem file whose bodies may slip and open."""
        if self.problem is None or self.kind.linear:
            return ()
        return tuple(of_layers(self.problem, self.friction or 0.0, self.roles))


def advise(problem: Problem | ContactPair | Path | str, *, tied: bool = False, progress: Progress = silent) -> Advice:
    """Advise on the roles of the bodies and on theta.

    rho and rho_min are the largest and the smallest ratio of two stiffnesses on the interface, of the contact body over
    the Neumann body.  The body with the smaller predicted rate ``rho/(2 + rho)`` gets the Neumann problem; for a tied
    interface the rate is ``(rho - rho_min)/(2 + rho_min + rho)``.

    Parameters
    ----------
    problem : Problem, ContactPair or path
    tied : bool
        True to advise for an interface where nothing opens or slips.
    progress : callable
        Called with the Lanczos steps where there are too many contact nodes for matrices.

    Returns
    -------
    Advice
        ``neumann_body`` is the body to read forces; ``best.theta_predicted``, ``best.rate_predicted`` and ``best.rho``
        belong to it; ``roles`` has both assignments.

    Raises
    ------
    ProblemError
        As :func:`verification.measure`, and where more contact nodes than interface matrices may have are held
        differently.

    Examples
    --------
    >>> from verification.problem.examples import example
    >>> found = advise(example("two-bars"))
    >>> found.neumann_body, round(found.best.theta_predicted, 6)
    (1, 0.857143)
    """
    return Advice.of(of_problem(problem, tied=tied, progress=progress))


def of_problem(
    problem: Problem | ContactPair | Path | str, *, tied: bool = False, progress: Progress = silent
) -> FromProblem:
    """The evidence behind :func:`advise`."""
    pair: ContactPair | TwoBodies
    try:
        pair = pair_or_bodies(problem)
        if isinstance(pair, TwoBodies):
            roles = _roles_without_matrices(pair, tied, progress)
        else:
            roles = (_role(pair, tied), _exchanged(pair, tied))
    except SingularRole as error:
        assert not isinstance(problem, ContactPair)  # made with roles that are not singular
        given = problem if isinstance(problem, Problem) else load(problem)
        pair = build(given.swapped())  # refused itself where contact holds that body, too
        roles = (Role.refused(given.iteration.neumann_body, error, of_file=True), _role(pair, tied))
    return FromProblem(
        roles=roles,
        kind=kind_of(tied=tied),
        problem=pair.problem,
        friction=float(pair.friction),
        outside=tuple(pair.outside),
    )


def spectrum_of(pair: ContactPair, *, normal: bool) -> Spectrum | None:
    """All eigenvalues of (P' S_c P, S_n), of the normal components if asked; None beyond ALL unknowns."""
    if pair.neumann.grid.size > ALL:
        return None
    with one_thread():
        return Spectrum.of(np.maximum(eigh(*(normal_pencil(pair) if normal else pencil(pair)), eigvals_only=True), 0.0))


def _exchanged(pair: ContactPair, tied: bool) -> Role:
    """The other assignment of the roles, which may be refused."""
    try:
        return _role(pair.swapped(), tied)
    except ValueError as error:
        return Role.refused(pair.contact_body, error, of_file=pair.problem is not None)


def _role(pair: ContactPair, tied: bool) -> Role:
    measured = measure(pair)
    energy = energy_bounds(measured)
    assert measured.rho_max is not None  # the two bodies have interface matrices
    if energy is None:
        nothing = measured.why_no_energy
        auto = by_prediction(measured.rho_max.value, nothing)
    else:
        nothing = f"outside the theorem: {pair.outside[0]}" if pair.outside else ""
        auto = automatic(energy, pair.outside, pair.settings.tolerance)
    rho, normal = measured.rho_max if energy is None else energy.rho, not (pair.friction or tied)
    return role_of(
        pair.neumann_body,
        rho,
        bounds=energy,
        nothing=nothing,
        threshold=None if nothing else measured.friction_threshold,
        no_threshold="" if nothing else measured.why_no_threshold,
        theta_auto=auto,
        energy=None if nothing else measured.energy_constants(),
        rho_min=measured.rho_min,
        rho_tied=measured.rho_max,
        spectrum=spectrum_of(pair, normal=normal),
        cells=None
        if pair.problem is None
        else suggest(pair.problem, rho if normal else measured.rho_max, normal=normal),
    )


def _roles_without_matrices(bodies: TwoBodies, tied: bool, progress: Progress) -> tuple[Role, ...]:
    """Both roles, the file's first, from rho, which is rho_normal in frictionless contact.

    A tied interface then needs two eigenvalues more.
    """
    pencils, problem = Pencils(bodies, progress), bodies.problem
    for why in pencils.reason.values():
        raise ProblemError(problem.source, "contact", None, f"no advice: {why}")
    needed, rubs, outside = needs_matrices(bodies), bool(bodies.friction), bodies.outside
    nothing = f"outside the theorem: {outside[0]}" if outside else needed if rubs else ""
    reason, order = {"theta_auto": needed}, (problem.iteration.neumann_body, problem.contact_body)
    if not (rubs or tied):
        more = "without friction rho is rho_normal, and a tied interface needs two more eigenvalues: ask for tied"
        reason["rho_min"] = more
    settings = {"nothing": nothing, "no_threshold": nothing or needed, "reason": reason}
    largest = lambda body, normal: pencils.largest(neumann_body=body, normal=normal).value
    roles = []
    for body, own in zip(order, (problem, problem.swapped()), strict=True):
        rho = Number.of_float(largest(body, not rubs))
        cells = suggest(own, rho, normal=not rubs)
        roles.append(plain_role(body, Fraction(rho.value), cells=cells, **settings))
    if rubs:
        return with_both_ends(roles)
    return with_both_ends(roles, [Number.of_float(largest(body, False)) for body in order]) if tied else tuple(roles)
