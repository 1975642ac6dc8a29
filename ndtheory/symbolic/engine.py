"""Deciding an algebraic statement over all admissible values: a proof, or an exact counterexample.

A statement is an equation or inequality between sympy expressions.  Charts give the values of its symbols: they insert
expressions in parameters that run freely over p > 0 or p >= 0 and reach every admissible value, so that roots disappear
and both sides become rational.  Then

* an equation holds if the numerator of the difference of its sides expands to 0,
* an inequality holds if its difference, less some squares where these are given, is a product of powers of polynomials
  without a negative coefficient,
* it fails if it fails at one point with rational coordinates.

Nothing here is rounded.  Both sides must be defined wherever the charts lead: common factors of numerator and
denominator may be cancelled.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import product
from random import Random
from typing import Any, Literal

import sympy as sp

from ndtheory.symbolic.quotient import NotRational, Quotient

#: Values that parameters take in the search for a counterexample.
TRIED = [sp.Rational(p, q) for p, q in ((1, 1), (1, 10), (3, 1), (1, 1000), (100, 1), (1, 2), (10**6, 1), (2, 1))]

#: Points that are tried: all combinations of the first two values, then as many random ones.
POINTS = 400

Of = Literal["printed", "step", "repaired"]


def positive(names: str) -> Any:
    """Symbols that run over p > 0."""
    return sp.symbols(names, positive=True)


def nonnegative(names: str) -> Any:
    """Symbols that run over p >= 0."""
    return sp.symbols(names, nonnegative=True)


@dataclass(frozen=True)
class Relation:
    """``left = right``, ``left <= right`` or ``left < right``."""

    left: Any
    sign: Literal["=", "<=", "<"]
    right: Any


@dataclass(frozen=True, kw_only=True)
class Decision:
    """The result of :func:`decide`.

    ``holds`` is None where neither a proof nor a counterexample was found; ``counterexample`` has the exact value of
    each symbol where a relation fails.
    """

    holds: bool | None
    counterexample: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Goal:
    """A relation with the charts that reach every admissible value of its symbols.

    ``charts`` give symbols as expressions in free parameters; one is empty where the symbols are free already.
    ``squares`` are subtracted from the difference before its coefficients are read; each is visibly non-negative
    (coefficients >= 0 times squares).
    """

    relation: Relation
    charts: Sequence[Mapping[Any, Any]] = ({},)
    squares: Sequence[Any] = ()


def decide(goals: Goal | Iterable[Goal]) -> Decision:
    """Decide goals together: each must hold in each of its charts.

    Raises
    ------
    ValueError
        No goal, no chart, a chart that leaves the range of a symbol, or a square that may be negative.

    Examples
    --------
    >>> p, q = positive("p q")
    >>> decide(Goal(relation=Relation(2 * p * q, "<=", p**2 + q**2), squares=[(p - q) ** 2])).holds
    True
    >>> decide(Goal(relation=Relation(3 * p * q, "<=", p**2 + q**2))).counterexample
    {'p': '1', 'q': '1'}
    """
    found: Decision = Decision(holds=True)
    together = [goals] if isinstance(goals, Goal) else list(goals)
    if not together or not all(goal.charts for goal in together):
        raise ValueError("nothing to decide: needed a goal, and a chart for each")
    for goal in together:
        for chart in goal.charts:
            decision = _in_chart(goal, chart)
            if decision.holds is False:
                return decision
            if decision.holds is None:
                found = decision
    return found


def rational(expression: Any) -> Any:
    """The same without the roots of squares, for non-negative symbols."""
    is_root = lambda term: term.is_Pow and term.exp.is_Rational and term.exp.q == 2
    return sp.sympify(expression).replace(is_root, lambda term: sp.sqrt(sp.factor(term.base)) ** (2 * term.exp))


def _in_chart(goal: Goal, chart: Mapping[Any, Any]) -> Decision:
    relation = goal.relation
    values = {symbol: sp.sympify(value) for symbol, value in chart.items()}
    for symbol, value in values.items():
        if symbol.is_nonnegative and not _certified(rational(value), strict=symbol.is_positive):
            raise ValueError(f"{symbol} = {value} leaves its range")
    inserted = lambda expression: rational(sp.sympify(expression).xreplace(values))
    difference = inserted(relation.right) - inserted(relation.left)
    if relation.sign == "=":
        quotient = _quotient(difference)
        if quotient is not None and not quotient.polynomial:  # the numerator expands to 0
            return Decision(holds=True)
    else:
        squares = [inserted(square) for square in goal.squares]
        if not all(map(_square, squares)):
            raise ValueError(f"one of {goal.squares} may be negative")
        if _certified(difference - sum(squares), strict=relation.sign == "<"):
            return Decision(holds=True)
    # exact numbers whose sign sympy knows; None, and so no failure, where it does not
    fails = {
        "=": lambda d: d.is_zero is False,
        "<=": lambda d: d.is_negative is True,
        "<": lambda d: d.is_nonpositive is True,
    }[relation.sign]
    parameters = sorted(difference.free_symbols, key=str)
    for point in _points(parameters):
        value_there = difference.xreplace(point)
        if value_there.is_finite and fails(value_there):  # at a pole nothing is compared
            names = sorted(sp.sympify(relation.left).free_symbols | sp.sympify(relation.right).free_symbols, key=str)
            value = lambda symbol, at=point: rational(_at_1(sp.sympify(chart.get(symbol, symbol)).subs(at)))
            return Decision(holds=False, counterexample={str(symbol): str(value(symbol)) for symbol in names})
    return Decision(holds=None)


def _at_1(expression: Any) -> Any:
    """Insert 1 for every symbol that is left: their values do not matter."""
    return expression.subs(dict.fromkeys(expression.free_symbols, sp.Integer(1)))


def _square(term: Any) -> bool:
    """True if a term is visibly a product of even powers and of factors with a certified sign."""
    factors = sp.Mul.make_args(sp.factor(term))
    return all((f.is_Pow and f.exp.is_even) or _certified(f, strict=False) for f in factors)


def _quotient(difference: Any) -> Quotient | None:
    """A difference as a quotient, if it is one; roots may cancel, and sympy finds those that do."""
    for read in (lambda: difference, lambda: sp.cancel(sp.together(difference))):
        with suppress(NotRational):
            return Quotient.of(read())
    return None


def _certified(difference: Any, *, strict: bool) -> bool:
    """True if its factors show the sign, or numerator and denominator do once common factors are cancelled."""
    quotient = _quotient(difference)
    return quotient is not None and (
        quotient.is_certified(strict=strict) or quotient.cancelled().is_certified(strict=strict)
    )


def _points(parameters: Sequence[Any]) -> Iterable[dict[Any, Any]]:
    """Rational points in a fixed order, those with a parameter 0 among them where that is admissible."""
    first = lambda symbol: [sp.Integer(0)] if symbol.is_nonnegative else [TRIED[0], -TRIED[0]]
    values = [TRIED if symbol.is_positive else [*first(symbol), *TRIED] for symbol in parameters]
    if len(parameters) <= 8:
        for choice in product(*(value[:2] for value in values)):
            yield dict(zip(parameters, choice, strict=True))
    random = Random(0)
    for _ in range(POINTS):
        yield {symbol: random.choice(value) for symbol, value in zip(parameters, values, strict=True)}


# --- vectors and bilinear forms, of which only linearity is known ----------------------------------------------------


class Vector(sp.Symbol):  # type: ignore[misc]
    """An element of a vector space; linear combinations are sympy expressions."""


def _terms(combination: Any) -> dict[Any, Any]:
    expanded = sp.expand(combination)
    vectors = sorted((s for s in expanded.free_symbols if isinstance(s, Vector)), key=str)
    terms = {vector: expanded.coeff(vector) for vector in vectors}
    if sp.expand(expanded - sum(c * v for v, c in terms.items())) != 0:
        raise ValueError(f"{combination}: needed a linear combination of vectors")
    return terms


def linear(name: str) -> Callable[[Any], Any]:
    """A linear map of which nothing else is known."""
    return lambda u: sum((c * Vector(f"{name} {v}") for v, c in _terms(u).items()), sp.Integer(0))


def functional(name: str) -> Callable[[Any], Any]:
    """A linear functional of which nothing else is known."""
    return lambda u: sum((c * sp.Symbol(f"{name}({v})", real=True) for v, c in _terms(u).items()), sp.Integer(0))


def bilinear(name: str) -> Callable[[Any, Any], Any]:
    """A symmetric bilinear form of which nothing else is known.

    Examples
    --------
    >>> u, v = Vector("u"), Vector("v")
    >>> a = bilinear("a")
    >>> decide(Goal(relation=Relation(a(u + v, u + v) - a(u - v, u - v), "=", 4 * a(u, v)))).holds
    True
    """

    def form(u: Any, v: Any) -> Any:
        pairs = product(_terms(u).items(), _terms(v).items())
        entry = lambda x, y: sp.Symbol(f"{name}({min(str(x), str(y))}, {max(str(x), str(y))})", real=True)
        return sum((a * b * entry(x, y) for (x, a), (y, b) in pairs), sp.Integer(0))

    return form


# --- a check of a statement ----------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Check:
    """The decision of a statement, as printed and as repaired, with mutants that must fail.

    ``text`` says what the check of the statement ``id`` shows.  ``goals`` takes a form of the statement (a formula, a
    sign, ..) to goals; ``forms`` are 'printed', 'step' and 'repaired', and each of the ``mutants``, by what was
    changed, must be refuted.  ``units`` has relations whose units are compared.  It is ``one_case`` if only one is
    computed, such as a bar: it may refute a form and cannot prove one.
    """

    id: str
    text: str
    goals: Callable[[Any], Goal | Iterable[Goal]]
    forms: Mapping[Of, Any]
    mutants: Mapping[str, Any]
    units: Mapping[Of, Relation | Sequence[Relation]] = field(default_factory=dict)
    one_case: bool = False

    def decide(self, form: Any) -> Decision:
        """Decide one form."""
        return decide(self.goals(form))


class CheckList(list[Check]):
    """The checks of one module, in the order of the paper."""

    def add(self, *, states: Callable[[Any], Relation | Sequence[Relation]] | None = None, **fields: Any) -> None:
        """Append a check; ``states`` turns a form into the relations whose units are compared."""
        if states is not None:
            printed = lambda name: "printed" if name == "step" else name
            fields["units"] = {printed(name): states(form) for name, form in fields["forms"].items()}
        self.append(Check(**fields))


def equal(left: Any, right: Any, *charts: Any) -> Goal:
    """left = right in each chart."""
    return Goal(relation=Relation(left, "=", right), charts=charts or ({},))


def at_most(bound: Any, value: Any, *charts: Any, squares: Sequence[Any] = ()) -> Goal:
    """value <= bound in each chart."""
    return Goal(relation=Relation(value, "<=", bound), charts=charts or ({},), squares=squares)


def less(left: Any, right: Any, *charts: Any) -> Goal:
    """left < right in each chart."""
    return Goal(relation=Relation(left, "<", right), charts=charts or ({},))
