"""Formulas of the library as JavaScript: each is called once with scalars that record what is done to them."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from functools import partialmethod
from typing import Any


class Scalar:
    """A number that writes down the operations made with it; equal ones are written once.

    ``text`` is its name in JavaScript, ``known`` has the names of the constants defined so far by their expressions.
    """

    def __init__(self, text: str, known: dict[str, str]) -> None:
        self.text, self.known = text, known

    def _new(self, expression: str, kind: type[Scalar] | None = None) -> Any:
        name = self.known.setdefault(expression, f"t{len(self.known)}")
        return (kind or Scalar)(name, self.known)

    def _binary(self, sign: str, other: Any, swap: bool = False) -> Any:
        a, b = (text(other), self.text) if swap else (self.text, text(other))
        return self._new(f"{a} {sign} {b}")

    __add__ = partialmethod(_binary, "+")
    __sub__ = partialmethod(_binary, "-")
    __mul__ = partialmethod(_binary, "*")
    __truediv__ = partialmethod(_binary, "/")
    __radd__ = partialmethod(_binary, "+", swap=True)
    __rsub__ = partialmethod(_binary, "-", swap=True)
    __rmul__ = partialmethod(_binary, "*", swap=True)
    __rtruediv__ = partialmethod(_binary, "/", swap=True)

    def __neg__(self) -> Any:
        return self._new(f"-{self.text}")

    def __pow__(self, power: Any) -> Any:
        if power == 0.5:
            return self._new(f"Math.sqrt({self.text})")
        if not isinstance(power, int) or not 0 < power < 10:
            raise NotImplementedError(f"{self.text} to the power {power}")
        return self._new(" * ".join([self.text] * power))

    def _compared(self, sign: str, other: Any) -> Any:
        return self._new(f"{self.text} {sign} {text(other)}", Condition)

    __lt__ = partialmethod(_compared, "<")
    __le__ = partialmethod(_compared, "<=")
    __gt__ = partialmethod(_compared, ">")
    __ge__ = partialmethod(_compared, ">=")
    __eq__ = partialmethod(_compared, "===")
    __ne__ = partialmethod(_compared, "!==")
    __hash__ = None  # type: ignore[assignment]

    def __bool__(self) -> bool:
        raise TypeError(f"{self.text}: a formula takes no `if` on a recorded scalar")


class Condition(Scalar):
    """The truth of a comparison, for :func:`ndtheory.scalar.where`."""

    def where(self, a: Any, b: Any) -> Any:
        return self._new(f"{self.text} ? {text(a)} : {text(b)}", Condition if isinstance(a, Condition | bool) else None)

    def __and__(self, other: Any) -> Any:
        return self._new(f"{self.text} && {text(other)}", Condition)

    __rand__ = __and__


def text(value: Any) -> str:
    """A scalar, a truth value or a number as JavaScript writes it."""
    if isinstance(value, Scalar):
        return value.text
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Fraction):
        return f"{value.numerator} / {value.denominator}"
    if isinstance(value, int) or (isinstance(value, float) and math.isfinite(value)):
        return f"({value!r})" if value < 0 else repr(value)
    raise NotImplementedError(f"{value!r} in a formula")


def function(name: str, formula: Callable[..., Any], *arguments: str) -> str:
    """A formula as a function of JavaScript; one that returns a tuple returns an array.

    Examples
    --------
    >>> print(function("rate", lambda rho: rho / (2 + rho), "rho"))
    function rate(rho) {
      const t0 = 2 + rho;
      const t1 = rho / t0;
      return t1;
    }
    """
    known: dict[str, str] = {}
    result = formula(*(Scalar(argument, known) for argument in arguments))
    lines = [f"  const {name} = {expression};" for expression, name in known.items()]
    returned = f"[{', '.join(map(text, result))}]" if isinstance(result, tuple) else text(result)
    return "\n".join([f"function {name}({', '.join(arguments)}) {{", *lines, f"  return {returned};", "}"])
