"""Advice from iterates of a run and their images, by any method of relaxation."""

from __future__ import annotations

from typing import Any

from verification.coupling.advice import Advice
from verification.coupling.kinds import Kind, kind_of
from verification.coupling.vectors import seen_in
from verification.interface.matrices import real_array, size


def advise_vectors(
    X: Any, TX: Any, *, tied: bool = False, kind: str | Kind | None = None, parallel: bool = False
) -> Advice:
    """Advice from a few iterates x of a run and their images T x, the run being relaxed by any method.

    T x is the answer of the contact body to the displacement that the Neumann body has under the force x, before it is
    relaxed.  Other quantities may be exchanged, as temperatures and fluxes.  Three to ten iterates are enough for
    most couplings.  While contact does not change, the differences of these vectors show eigenvalues of ``T``:
    :func:`verification.coupling.vectors.seen_in`.

    Parameters
    ----------
    X, TX : array, shape (k, n)
        A row for each of k >= 2 iterates, in the order of the run.
    tied : bool
        True if nothing opens or slips.  Otherwise, where the vectors show that contact changes, theta is chosen for
        open nodes as well.
    kind : {'contact', 'tied', 'general'}, optional
        Of a coupling that is not in contact entries that are 0 are data; of kind general eigenvalues may be below 0.
    parallel : bool
        True if both solvers run at once: then a row has the force and behind it the displacement, and its image what
        the contact body answers to that displacement and the Neumann body to that force.

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
        Arrays of other shapes, entries that are not finite, iterates that do not differ, or an unknown kind.

    Examples
    --------
    >>> import numpy as np
    >>> image = lambda x: 1 - np.array([0.5, 3.0]) * (x - 1)
    >>> X = [np.zeros(2)]
    >>> for _ in range(3):
    ...     X.append(0.6 * X[-1] + 0.4 * image(X[-1]))
    >>> found = advise_vectors(X, [image(x) for x in X])
    >>> round(found.spectrum.low, 9), round(found.spectrum.high, 9), found.theta
    (0.5, 3.0, 0.3592)
    """
    of = kind_of(kind, tied=tied, parallel=parallel)
    needed = "a row of real numbers for each iterate, two rows or more"
    given = [real_array(name, rows, (None, None), needed) for name, rows in (("X", X), ("TX", TX))]
    if given[0].shape != given[1].shape:
        shapes = " and ".join(map(size, given))
        raise ValueError(f"X and TX are {shapes}: needed an image for each iterate, of the same length")
    if len(given[0]) < 2:
        raise ValueError(f"X is {size(given[0])}: needed {needed}")
    if of.parallel and given[0].shape[1] % 2:
        raise ValueError(
            f"X is {size(given[0])}: needed both fields in a row, of one length, as the coupling is parallel"
        )
    return Advice.of(seen_in(*given, kind=of))
