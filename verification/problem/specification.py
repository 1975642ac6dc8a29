"""A problem: two bodies, their contact, the iteration and the norm."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from decimal import Decimal
from fractions import Fraction
from typing import Any, Literal

from ndtheory import HypothesisError, relaxation_factor
from verification.problem.meshes import MeshFile
from verification.problem.read_only import ReadOnly
from verification.problem.tables import ProblemError

#: A displacement or a force by component; None leaves a displacement component free.
Components = tuple[Fraction | None, ...]

#: What is read as a number, exactly: a float means its shortest decimal, a text may be a fraction.
Rational = int | float | str | Decimal | Fraction

#: A relaxation factor, or the one that theory chooses.
Theta = Fraction | Literal["auto"]

RECTANGLE_SIDES = ("left", "right", "bottom", "top")
INTERVAL_SIDES = ("left", "right")

#: Largest number of cells of a body; a typing error should not fill the memory.
MOST_CELLS = 250_000

#: Largest ratio of the two moduli: at 1e60 the bounds of Section 5, with high powers of M C_R / m, overflow a double.
MOST_CONTRAST = Fraction(10**30)

#: Largest coefficient of friction; larger ones differ from it by nothing but overflow, as all contact sticks.
MOST_FRICTION = Fraction(10**9)


@dataclass(frozen=True, kw_only=True)
class SidePart:
    """A part of a side of a body, between two positions along an axis.

    Attributes
    ----------
    side : str
    axis : {'x', 'y'}
    ends : pair of Fraction
        Unit of length; the part has the edges of the side that lie between them.
    """

    side: str
    axis: Literal["x", "y"]
    ends: tuple[Fraction, Fraction]


@dataclass(frozen=True, kw_only=True)
class BodySpec:
    """A body as the problem file describes it; lengths and stresses in the file's units.

    Attributes
    ----------
    shape : {'rectangle', 'interval', 'mesh', 'rigid'}
        A rigid body is an obstacle: of the rest it has x and y at most.
    x, y : pair of Fraction or None
    cells : tuple of int or None
    mesh : MeshFile or None
    young, poisson : Fraction
        E in stress; Poisson's ratio is 0 for a bar.  Both 0 where rigid.
    parts : read-only mapping from name to SidePart
        Parts of sides that are named like sides.
    fixed : tuple of str
    prescribed, traction : read-only mapping from side to components
        Displacement (length; None: free) and force per area (stress).
    body_force : tuple of Fraction
        Force per volume.
    """

    shape: Literal["rectangle", "interval", "mesh", "rigid"]
    x: tuple[Fraction, Fraction] | None = None
    y: tuple[Fraction, Fraction] | None = None
    cells: tuple[int, ...] | None = None
    mesh: MeshFile | None = None
    young: Fraction = Fraction(0)
    poisson: Fraction = Fraction(0)
    parts: Mapping[str, SidePart] = field(default_factory=ReadOnly)
    fixed: tuple[str, ...] = ()
    prescribed: Mapping[str, Components] = field(default_factory=ReadOnly)
    traction: Mapping[str, tuple[Fraction, ...]] = field(default_factory=ReadOnly)
    body_force: tuple[Fraction, ...] = ()

    def __post_init__(self) -> None:
        for name in ("parts", "prescribed", "traction"):
            object.__setattr__(self, name, ReadOnly(getattr(self, name)))

    @property
    def rigid(self) -> bool:
        """Whether the body is an obstacle."""
        return self.shape == "rigid"


@dataclass(frozen=True, kw_only=True)
class ContactSpec:
    """Gamma_c, the friction law and the initial distance.

    Attributes
    ----------
    interval : pair of Fraction or None
        Ends of Gamma_c along x; None: the overlap of the two surfaces.
    friction : Fraction
        k, constant along Gamma_c.
    law : str
        One of :data:`verification.interface.friction.LAWS`.
    radius : Fraction or None
        Radius r of the hat kernel (length); None with a law that has none or without friction.
    gap : Fraction
        Initial distance (length).
    """

    interval: tuple[Fraction, Fraction] | None
    friction: Fraction
    law: str
    radius: Fraction | None
    gap: Fraction


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a run goes: its relaxation and when it ends.

    Attributes
    ----------
    theta : Fraction or 'auto'
        ``auto``: the proved theta; the predicted one where nothing is proved or the proved one is more than twice as
        slow.  Momentum takes its step from rho: ``auto`` unless the file has a theta, which is then not used.
    relaxation : str
        One of :data:`verification.algorithm.relaxation.RULES`; beside ``constant`` outside the theorem.
    tolerance : float
        The run ends when ``|||T g - g||| <= tolerance |||T g|||`` in the norm (5.21), with the largest T g so far.
    max_iterations : int
    """

    theta: Theta = Fraction(1, 2)
    relaxation: str = "constant"
    tolerance: float = 1e-9
    max_iterations: int = 500


@dataclass(frozen=True, kw_only=True)
class IterationSpec(Settings):
    """The table ``[iteration]``.

    Attributes
    ----------
    neumann_body : {1, 2}
        Who gets the linear problem of step I: 2 as in Section 3, 1 as in Section 6.
    """

    neumann_body: Literal[1, 2] = 2

    @property
    def settings(self) -> Settings:
        """The table without the roles."""
        return Settings(**{field.name: getattr(self, field.name) for field in fields(Settings)})


@dataclass(frozen=True, kw_only=True, repr=False)
class Problem:
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

    title: str
    dimension: Literal[1, 2]
    units: Mapping[str, str]
    body1: BodySpec
    body2: BodySpec
    contact: ContactSpec
    iteration: IterationSpec
    length: Fraction
    source: str = field(default="<dict>", compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "units", ReadOnly(self.units))

    def __repr__(self) -> str:
        bodies = " / ".join("rigid" if body.rigid else f"E {float(body.young):g}" for body in (self.body1, self.body2))
        return f"<Problem: {self.title}, {self.dimension}D, {bodies}, k = {float(self.contact.friction):g}>"

    # the modules that read, write and change problems know this one, so that they are imported in the methods

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], source: str = "<dict>") -> Problem:
        """Validate a nested dictionary with the keys of the problem file.

        Raises
        ------
        ProblemError
            Naming source, key, value received and what is needed.
        """
        from verification.problem.reading import read_problem

        return read_problem(data, source)

    def to_dict(self) -> dict[str, Any]:
        """The nested dictionary of the problem file, from which :meth:`from_dict` makes an equal problem.

        It holds every key that has a value, defaults too; a key without one (no interval, no radius, no sides) is left
        out.  Equal problems give equal dictionaries.  A number is a number where the decimal that JSON prints of it is
        exact, a text such as ``"1/3"`` elsewhere.  A mesh file stands there by its absolute path and the SHA-256 of its
        content, and :meth:`from_dict` refuses a file whose content is another.
        """
        from verification.problem.writing import plain, tables

        written: dict[str, Any] = plain(tables(self))
        return written

    def to_toml(self) -> str:
        """The text of a problem file (UTF-8) that reads back as an equal problem, wherever it is kept.

        Raises
        ------
        ProblemError
            The path of a mesh file is no text, so that no TOML can name it.
        """
        from verification.problem.toml import document

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
        from verification.problem.digest import fingerprint

        return fingerprint(self)

    def changed(
        self,
        *,
        title: str | None = None,
        young: Sequence[Rational | None] | None = None,
        poisson: Sequence[Rational | None] | None = None,
        cells: Sequence[int | Sequence[int] | None] | None = None,
        friction: Rational | None = None,
        law: str | None = None,
        radius: Rational | None = None,
        gap: Rational | None = None,
        neumann_body: int | None = None,
        theta: Rational | None = None,
        relaxation: str | None = None,
        tolerance: Rational | None = None,
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
        from verification.problem.changes import with_each

        contact = {"friction": friction, "law": law, "radius": radius, "gap": gap}
        iteration = {
            "neumann_body": neumann_body,
            "theta": theta,
            "relaxation": relaxation,
            "tolerance": tolerance,
            "max_iterations": max_iterations,
        }
        return with_each(
            self,
            {"young": young, "poisson": poisson, "cells": cells},
            {
                ("title",): title,
                **{("contact", name): value for name, value in contact.items()},
                **{("iteration", name): value for name, value in iteration.items()},
            },
        )

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
        from verification.problem.changes import with_keys

        return with_keys(self, values)

    def with_theta(self, theta: Any) -> Problem:
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


def read_theta(value: Any) -> Theta:
    """A relaxation factor, or "auto".

    Raises
    ------
    HypothesisError
    """
    if value == "auto":
        return "auto"
    try:
        return relaxation_factor(value)
    except HypothesisError as error:
        raise HypothesisError(error.key, error.value, f'{error.needed}, or "auto"') from None
