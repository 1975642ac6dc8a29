"""A problem: two bodies, their contact, the iteration and the norm; read, written and changed."""

from __future__ import annotations

import hashlib
import json
import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import Any, Literal

from ndtheory.number import Numeric
from ndtheory.texts import did_you_mean
from verification.problem.entries import Entries, names
from verification.problem.readers import read_theta, takes_theta
from verification.problem.reading import read_problem
from verification.problem.specs import MOST_CELLS, BodySpec, ContactSpec, IterationSpec, ProblemSpec
from verification.problem.tables import QUOTED, ProblemError
from verification.problem.tables import plain as bare
from verification.problem.writing import plain, toml

#: A key by its tables and its name.
Key = tuple[str, ...]

#: The tables whose keys :meth:`Problem.changed` takes by name, without the table.
TABLES: dict[Key, type[Entries]] = {("contact",): ContactSpec, ("iteration",): IterationSpec, (): ProblemSpec}

#: Stands where a value would, while a key is read.
_HERE = "value"


@dataclass(frozen=True, kw_only=True, repr=False)
class Problem(ProblemSpec):
    """A validated problem; see the problem file in the documentation.

    Two problems are equal if all their values are, except ``source``, the file that errors name.  :attr:`digest`
    compares only values that change a number.

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
        bodies = " / ".join("rigid" if body.rigid else f"E {float(body.young):g}" for body in self.bodies.values())
        return f"<Problem: {self.title}, {self.dimension}D, {bodies}, k = {self.friction_words}>"

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], source: str = "<dict>") -> Problem:
        """Validate a nested dictionary with the keys of the problem file; numbers and arrays may be those of numpy.

        Raises
        ------
        ProblemError
            Naming source, key, value received and what is needed.
        """
        return cls(**vars(read_problem(data, source)))

    def to_dict(self) -> dict[str, Any]:
        """Return the nested dictionary of the problem file, from which :meth:`from_dict` makes an equal problem.

        It holds every key that has a value, defaults too; a key without one (no interval, no radius, no sides) is left
        out.  Equal problems give equal dictionaries.  A number is a number where the decimal that JSON prints of it is
        exact, a text such as ``"1/3"`` elsewhere.  A mesh file is written as its absolute path and the SHA-256 of its
        content, and :meth:`from_dict` refuses a file with other content.
        """
        return super().to_dict()

    def to_toml(self) -> str:
        """Return the text of a problem file (UTF-8) that reads back as an equal problem, wherever it is kept.

        Raises
        ------
        ProblemError
            The path of a mesh file is not UTF-8, so that TOML cannot name it.
        """
        written = toml(self.to_dict())
        try:
            written.encode()
        except UnicodeEncodeError:
            raise self.refuse("mesh", None, "needed a mesh file whose path is UTF-8") from None
        return written

    @property
    def digest(self) -> str:
        """SHA-256, in hexadecimal digits, of what changes a number.

        Left out are title, labels of units, source, the places of mesh files (their content counts) and the order of
        sides.  It outlives releases: a key that the problem file gets later counts only where it has no default.
        """
        data = plain(self.tables(counting=True))
        text = json.dumps(data, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode("ascii")).hexdigest()

    def changed(self, **values: Any) -> Problem:
        """Return the same problem with other values, read and refused like the values of a file.

        Parameters
        ----------
        values
            Keys of ``[contact]``, of ``[iteration]`` or of no table; keys of a body as pairs, for body 1 and body 2.
            None leaves a value as it is.  With several bodies ``neumann_body`` is 1 for those with the role of body 1.
            Friction may be a function k(s) of the distance along Gamma_c from its left end, read at the contact nodes
            of rectangles (for mesh files: :func:`verification.build`).  Momentum without a theta sets it to ``"auto"``.

        Raises
        ------
        ProblemError
            Naming the key as the problem file has it.

        Examples
        --------
        >>> from verification.problem.examples import example
        >>> str(example("section6").changed(friction="1/3").contact.friction)
        '1/3'
        """
        given: dict[Key, Any] = {}
        for name, value in values.items():
            if value is not None:
                given |= self._given(name, value)
        return self._with(given)

    def _given(self, name: str, value: Any) -> dict[Key, Any]:
        """Return what a value of :meth:`changed` sets."""
        if name == "neumann_body" and self.several and value in (1, 2):
            return {("iteration", "neumann_bodies"): self.numbers(value)}
        value = self._read_at_nodes(value) if name == "friction" and callable(value) else bare(value)
        for table, cls in TABLES.items():
            if name in names(cls):
                return {(*table, name): value}
        if name not in names(BodySpec):
            known = [name for cls in (*TABLES.values(), BodySpec) for name in names(cls)]
            raise TypeError(f"changed() has no argument {name!r}{did_you_mean(name, known)}")
        if self.several:
            raise self.refuse(name, value, f"needed with_keys, as body3.{name}: there are more than two bodies")
        if not isinstance(value, (list, tuple)) or len(value) != 2:
            raise self.refuse(name, value, "needed two values, for body 1 and body 2 (None leaves a body as it is)")
        return {(f"body{i}", name): one for i, one in enumerate(value, 1) if one is not None}

    def _read_at_nodes(self, function: Callable[[float], float]) -> dict[str, list[Any]]:
        """Return the table of a function at the contact nodes of a rectangle."""
        if self.several:
            raise self.refuse("contact.friction", None, "needed a number or a table in each [[contact]] of the file")
        body, other = self.body1, self.body2
        if self.contact_body == 2:
            body, other = other, body
        ends = [spec.x for spec in (body, other) if spec.x is not None]
        if body.x is None or body.cells is None or not (self.contact.interval or other.x or other.rigid):
            needed = "needed a table, or verification.build(problem, friction=function), as a mesh file has the nodes"
            raise self.refuse("contact.friction", None, needed)
        low, high = self.contact.interval or (max(x[0] for x in ends), min(x[1] for x in ends))
        width = (body.x[1] - body.x[0]) / body.cells[0]
        nodes = [body.x[0] + i * width for i in range(body.cells[0] + 1)]
        s = [node - low for node in nodes if low <= node <= high]
        return {"s": s, "k": [function(float(at)) for at in s]}

    def with_keys(self, values: Mapping[str, Any]) -> Problem:
        """Return the problem with keys of its file set: ``{"contact.friction": "0.4", "body1.cells": "[40, 6]"}``.

        Parameters
        ----------
        values : mapping from dotted key to value
            A text is read as a TOML value; a text that is none and opens none is taken literally (``auto``, ``1/3``).
            Any other object is taken as it is.  Keys are set one after the other.

        Raises
        ------
        ProblemError
        """
        source = self.source
        return self._with({_key(name, source): _value(name, value, source) for name, value in values.items()})

    def _with(self, values: Mapping[Key, Any]) -> Problem:
        """Set some keys of the file, in order; a rule that takes its step from rho, without a theta, gets ``auto``."""
        data = self.tables()
        if not takes_theta(values.get(("iteration", "relaxation"))):
            values = {("iteration", "theta"): "auto", **values}
        for key, value in values.items():
            *parents, name = key
            table = data
            for depth, parent in enumerate(parents, 1):
                table = table.setdefault(parent, {})
                if not isinstance(table, dict):
                    what = "no table" if not isinstance(table, tuple) else "a list of tables, which only a file changes"
                    needed = f"unknown key; {'.'.join(key[:depth])} is {what}"
                    raise self.refuse(".".join(key), None, needed)
            table[name] = value
        return Problem.from_dict(data, self.source)

    def with_theta(self, theta: Numeric) -> Problem:
        """Return the same problem at another theta.

        Raises
        ------
        HypothesisError
            Unless 0 < theta < 1 or "auto".
        """
        return replace(self, iteration=replace(self.iteration, theta=read_theta(theta)))

    @property
    def prescribes(self) -> tuple[tuple[str, ...], ...]:
        """The sides with prescribed displacements, body by body."""
        return tuple(tuple(body.prescribed) for body in self.bodies.values())

    @property
    def contact_body(self) -> Literal[1, 2]:
        """The body that carries the contact grid: the one without the Neumann problem, or the only elastic one."""
        if self.body1.rigid or self.body2.rigid:
            return 2 if self.body1.rigid else 1
        return 1 if self.iteration.neumann_body == 2 else 2

    def swapped(self) -> Problem:
        """Return the same problem with the Neumann problem given to the other body."""
        other: Literal[1, 2] = 1 if self.iteration.neumann_body == 2 else 2
        bodies = self.numbers(other) if self.several else ()
        return replace(self, iteration=replace(self.iteration, neumann_body=other, neumann_bodies=bodies))

    def refined(self, halvings: int) -> Problem:
        """Return the same problem on a mesh halved ``halvings`` times.

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
                raise self.refuse(f"{name}.mesh", named, "a mesh file cannot be halved")
            cells = tuple(n * 2**halvings for n in body.cells)
            if math.prod(cells) > MOST_CELLS:
                needed = f"needed at most {MOST_CELLS} cells after {halvings} halvings"
                raise self.refuse(f"{name}.cells", list(cells), needed)
            return replace(body, cells=cells)

        if not isinstance(halvings, int) or halvings < 0:  # type: ignore[redundant-expr]  # a caller need not be typed
            raise ValueError(f"{halvings} halvings: a whole number >= 0 is needed")
        return self.holding({i: halved(f"body{i}", body) for i, body in self.bodies.items()})


def _key(name: str, source: str) -> Key:
    """Split ``body2.prescribed.top`` into its parts; TOML reads it, so that a part may be quoted."""
    refused = ProblemError(source, name or QUOTED, None, "needed the name of a key, such as contact.friction")
    try:
        found: Any = tomllib.loads(f'{name} = "{_HERE}"') if name.isprintable() else None
    except (tomllib.TOMLDecodeError, RecursionError):
        raise refused from None
    parts = []
    while isinstance(found, dict) and len(found) == 1:
        [(part, found)] = found.items()
        parts.append(part)
    if found != _HERE or not parts:
        raise refused
    return tuple(parts)


def _value(name: str, value: Any, source: str) -> Any:
    """Read a TOML value; a text that is none and opens none is taken literally."""
    if not isinstance(value, str):
        return value
    if not value.strip():
        raise ProblemError(source, name, value, 'needed a value (an empty text is "")')
    try:
        found = tomllib.loads(f"{_HERE} = {value}", parse_float=Decimal)
        if len(found) == 1:
            return found[_HERE]
    except (ValueError, ArithmeticError, RecursionError):
        pass
    if value.lstrip()[0] in "\"'[{":
        raise ProblemError(source, name, value, "this is not a TOML value: a bracket, brace or quotation mark is wrong")
    return value
