"""Advice from iterates of a run and their images, by any method of relaxation."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ndtheory import Number
from verification.coupling import methods
from verification.coupling.methods import MethodRow
from verification.coupling.roles import PROVED, Advice, Role, role_on, table_of
from verification.coupling.spectrum import SeenVectors, Spectrum, seen_in
from verification.interface.matrices import real_array, size
from verification.interface.pair import UNITS

#: Why nothing is proved.
ESTIMATED = "from which eigenvalues were estimated, prove nothing"


def advise_vectors(X: Any, TX: Any, *, tied: bool = False) -> Advice:
    """Advice from a few iterates x of a run and their images T x, the run being relaxed by any method.

    T x is what the contact body answers to the displacement that the Neumann body has under the force x, before it is
    relaxed; or any other quantity that is exchanged, as temperatures and fluxes.  Three to ten iterates are enough for
    most couplings.  While contact does not change, the differences of these vectors show eigenvalues of ``T``:
    :func:`verification.coupling.spectrum.seen_in`.

    Parameters
    ----------
    X, TX : array, shape (k, n)
        A row for each of k >= 2 iterates, in the order of the run.
    tied : bool
        True if nothing opens or slips.  Otherwise, where the vectors show that contact changes, theta is chosen for
        open nodes as well.

    Returns
    -------
    Advice
        ``spectrum.low`` and ``spectrum.high`` are the ends as estimated, ``theta`` is to paste, ``methods`` compares
        constant relaxation, Aitken and IQN-ILS, also with the roles exchanged.  No theta and no spectrum while
        contact still changes in the last iterates, or where the eigenvalues are negative; no theta while the largest
        eigenvalue still changes with every iterate: `methods` then has the exchanged roles, if the least is found.

    Raises
    ------
    ValueError
        Arrays of other shapes, entries that are not finite, or iterates that do not differ.

    Examples
    --------
    >>> import numpy as np
    >>> image = lambda x: 1 - np.array([0.5, 3.0]) * (x - 1)
    >>> X = [np.zeros(2)]
    >>> for _ in range(3):
    ...     X.append(0.6 * X[-1] + 0.4 * image(X[-1]))
    >>> found = advise_vectors(X, [image(x) for x in X])
    >>> round(found.spectrum.low, 9), round(found.spectrum.high, 9), found.theta
    (0.5, 3.0, 0.3636)
    """
    needed = "a row of real numbers for each iterate, two rows or more"
    given = [real_array(name, rows, (None, None), needed) for name, rows in (("X", X), ("TX", TX))]
    if given[0].shape != given[1].shape:
        shapes = " and ".join(map(size, given))
        raise ValueError(f"X and TX are {shapes}: needed an image for each iterate, of the same length")
    if len(given[0]) < 2:
        raise ValueError(f"X is {size(given[0])}: needed {needed}")
    return advice_of(seen_in(*given, tied=tied), tied=tied)


def advice_of(seen: SeenVectors, *, tied: bool = False) -> Advice:
    """The advice for a spectrum that vectors show."""
    if not (seen.settled or tied) or seen.negative:
        return Advice(neumann_body=None, roles=(), units=UNITS, vectors=seen)
    linear = tied or not seen.changing
    spectrum = seen.spectrum if linear else seen.spectrum.with_open_nodes()
    if not seen.high_found:
        return _of_the_least_end(spectrum, seen, tied=linear)
    return advice_on(spectrum, tied=linear, of="vectors", vectors=seen)


def _of_the_least_end(spectrum: Spectrum, seen: SeenVectors, *, tied: bool) -> Advice:
    """The advice while the largest eigenvalue is not found: the exchanged roles, where the least one is.

    Their largest eigenvalue is one over the least of these roles; their least one may be any down to 0.
    """
    because = dict.fromkeys(("theta_predicted", "rate_predicted", *PROVED, "friction_threshold"), seen.why_no_theta)
    reason = {**_unnumbered("vectors"), **because, "rho_min": seen.why_no_theta}
    role = Role(neumann_body=None, rho=Number.of_float(max(spectrum.high, 0.0)), spectrum=spectrum, reason=reason)
    table: tuple[MethodRow, ...] = ()
    if seen.low_found and spectrum.low - spectrum.error_low > 0:
        exchanged = _role(spectrum.exchanged().with_open_nodes(), "vectors")
        table = tuple(replace(row, exchanged=True) for row in table_of([exchanged], tied=True))
    method = methods.advised(table, tied=tied)
    return Advice(neumann_body=None, roles=(role,), units=UNITS, tied=tied, methods=table, method=method, vectors=seen)


def advice_on(spectrum: Spectrum, *, tied: bool, of: str, **known: Any) -> Advice:
    """The advice on an estimated spectrum, in which open nodes are already; ``of`` names what it was read from."""
    roles = [_role(spectrum, of)]
    if spectrum.low - spectrum.error_low > 0:
        roles.append(_role(spectrum.exchanged(), of))
    table = table_of(roles, tied=True)
    return Advice(
        neumann_body=None,
        roles=tuple(roles[:1]),
        units=UNITS,
        tied=tied,
        methods=table,
        method=methods.advised(table, tied=tied),
        **known,
    )


def _role(spectrum: Spectrum, of: str) -> Role:
    """The role of an estimated spectrum."""
    return role_on(None, spectrum, nothing=f"{of}, {ESTIMATED}", reason=_unnumbered(of))


def _unnumbered(of: str) -> dict[str, str]:
    """The reason why the body of a role has no number."""
    return {"neumann_body": f"{of} do not tell which body had the Neumann problem"}
