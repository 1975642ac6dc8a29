"""A problem: two bodies, their contact, the iteration and the norm; read, written and changed."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from ndtheory.number import Numeric
from verification.problem.changes import Key, given, typed, with_values
from verification.problem.digest import fingerprint
from verification.problem.reading import read_problem
from verification.problem.specs import MOST_CELLS, BodySpec, ProblemSpec, read_theta
from verification.problem.tables import ProblemError
from verification.problem.toml import document
from verification.problem.vocabulary import vocabulary
from verification.problem.writing import plain, tables


@dataclass(frozen=True, kw_only=True, repr=False)
class Problem(ProblemSpec):
    """A validated problem; see the problem file in the documentation.

    Problems are equal where all but their source is; :attr:`digest` asks only for what changes a number.

    Attributes
    ----------
    source : str
        The file it came from, or ``<dict>``; errors name it.
    units : read-only mapping
        Labels ``length`` and ``stress``.
    length : Fraction
        L of the norm ``|v|^2/L^2 + |grad v|^2``.

    Examples
    --------
    >>> bars = Problem.from_dict({
    ...     "dimension": 1,
    ...     "body1": {"shape": "interval", "x": [0, 1], "cells": 4, "young": 2, "fixed": ["left"]},
    ...     "body2": {"shape": "interval", "x": [1, 2], "cells": 4, "young": 1, "prescribed": {"right": "-1/10"}},
    ... })
    >>> bars.iteration.neumann_body, bars.body2.prescribed["right"]
    (2, (Fraction(-1, 10),))
    >>> bars.changed(young=(None, 4)).body2.young
    Fraction(4, 1)
    """

    def __repr__(self) -> str:
        bodies = " / ".join("rigid" if body.rigid else f"E {float(body.young):g}" for body in (self.body1, self.body2))
        return f"<Problem: {self.title}, {self.dimension}D, {bodies}, k = {float(self.contact.friction):g}>"

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], source: str = "<dict>") -> Problem:
        """Validate a nested dictionary with the keys of the problem file.

        Raises
        ------
        ProblemError
            Naming source, key, value received and what is needed.
        """
        return cls(**vars(read_problem(data, source, vocabulary())))

    def to_dict(self) -> dict[str, Any]:
        """The nested dictionary of the problem file, from which :meth:`from_dict` makes an equal problem.

        It holds every key that has a value, defaults too; a key without one (no interval, no radius, no sides) is left
        out.  Equal problems give equal dictionaries.  A number is a number where the decimal that JSON prints of it is
        exact, a text such as ``"1/3"`` elsewhere.  A mesh file stands there by its absolute path and the SHA-256 of its
        content, and :meth:`from_dict` refuses a file whose content is another.
        """
        written: dict[str, Any] = plain(tables(self))
        return written

    def to_toml(self) -> str:
        """The text of a problem file (UTF-8) that reads back as an equal problem, wherever it is kept.

        Raises
        ------
        ProblemError
            The path of a mesh file is no text, so that no TOML can name it.
        """
        written = document(self.to_dict())
        try:
            written.encode()
        except UnicodeEncodeError:
            raise ProblemError(self.source, "mesh", None, "needed a mesh file whose path is UTF-8") from None
        return written

    @property
    def digest(self) -> str:
        """SHA-256, in hexadecimal digits, of what changes a number.

        Left out are title, labels of units, source, the places of mesh files (their content counts) and the order of
        sides.  It outlives releases: a key that the problem file gets later counts only where it has no default.
        """
        return fingerprint(self)

    def changed(
        self,
        *,
        title: str | None = None,
        young: Sequence[Numeric | None] | None = None,
        poisson: Sequence[Numeric | None] | None = None,
        cells: Sequence[int | Sequence[int] | None] | None = None,
        friction: Numeric | None = None,
        law: str | None = None,
        radius: Numeric | None = None,
        gap: Numeric | None = None,
        neumann_body: int | None = None,
        theta: Numeric | None = None,
        relaxation: str | None = None,
        tolerance: Numeric | None = None,
        max_iterations: int | None = None,
    ) -> Problem:
        """The same problem with other values, read as those of a file are: exactly, and refused by the same words.

        Parameters
        ----------
        young, poisson, cells : pair
            For body 1 and body 2; None leaves a body as it is.
        friction, law, radius, gap, neumann_body, theta, relaxation, tolerance, max_iterations, title
            As in the problem file.  Momentum takes its step from rho: without a theta it comes with ``"auto"``.

        Raises
        ------
        ProblemError
            Naming the key as the problem file has it.
        """
        contact = {"friction": friction, "law": law, "radius": radius, "gap": gap}
        iteration = {
            "neumann_body": neumann_body,
            "theta": theta,
            "relaxation": relaxation,
            "tolerance": tolerance,
            "max_iterations": max_iterations,
        }
        each: dict[Key, Any] = {
            ("title",): title,
            **{("contact", name): value for name, value in contact.items()},
            **{("iteration", name): value for name, value in iteration.items()},
        }
        return self._with(given(each, {"young": young, "poisson": poisson, "cells": cells}, self.source))

    def with_keys(self, values: Mapping[str, Any]) -> Problem:
        """The same problem with keys of its file set, as ``{"contact.friction": "0.4", "body1.cells": "[40, 6]"}``.

        Parameters
        ----------
        values : mapping from dotted key to value
            A text is read as a TOML value; one that is no TOML value and opens none is meant as it stands (``auto``,
            ``1/3``).  What is no text is taken as it is.  Keys are set one after the other.

        Raises
        ------
        ProblemError
        """
        return self._with(typed(values, self.source))

    def _with(self, values: Iterable[tuple[Key, Any]]) -> Problem:
        return Problem(**vars(with_values(self, values, vocabulary())))

    def with_theta(self, theta: Numeric) -> Problem:
        """The same problem at another theta.

        Raises
        ------
        HypothesisError
            Unless 0 < theta < 1 or "auto".
        """
        return replace(self, iteration=replace(self.iteration, theta=read_theta(theta)))

    @property
    def contact_body(self) -> Literal[1, 2]:
        """The body that carries the contact grid: the one without the Neumann problem, or the only elastic one."""
        if self.body1.rigid or self.body2.rigid:
            return 2 if self.body1.rigid else 1
        return 1 if self.iteration.neumann_body == 2 else 2

    def swapped(self) -> Problem:
        """The same problem with the Neumann problem given to the other body."""
        other: Literal[1, 2] = 1 if self.iteration.neumann_body == 2 else 2
        return replace(self, iteration=replace(self.iteration, neumann_body=other))

    def refined(self, halvings: int) -> Problem:
        """The same problem on a mesh halved ``halvings`` times.

        Raises
        ------
        ProblemError
            A body given by a mesh file cannot be halved.
        """

        def halved(name: str, body: BodySpec) -> BodySpec:
            if not halvings or body.rigid:
                return body
            if body.cells is None:
                named = body.mesh.path.name if body.mesh else None
                raise ProblemError(self.source, f"{name}.mesh", named, "a mesh file cannot be halved")
            cells = tuple(n * 2**halvings for n in body.cells)
            if math.prod(cells) > MOST_CELLS:
                needed = f"needed at most {MOST_CELLS} cells after {halvings} halvings"
                raise ProblemError(self.source, f"{name}.cells", list(cells), needed)
            return replace(body, cells=cells)

        if not isinstance(halvings, int) or halvings < 0:  # type: ignore[redundant-expr]  # a caller need not be typed
            raise ValueError(f"{halvings} halvings: a whole number >= 0 is needed")
        return replace(self, body1=halved("body1", self.body1), body2=halved("body2", self.body2))
