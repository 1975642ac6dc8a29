"""One formula, any scalar: one that writes JavaScript and refuses to be a truth value, and an interval."""

import inspect
import math
import operator
from functools import cache

import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from mpmath import iv, mp, mpf

from ndtheory import EDITIONS, bounds, energy_norms
from ndtheory.scalar import absolute, maximum, minimum, sqrt, where

#: What is no formula: they read constants, or answer None where there is no interval.
NO_FORMULAS = {"evaluate", "evaluate_energy", "contraction_interval", "best_theta"}


def formulas(module):
    """The public functions that a module defines."""
    own = inspect.getmembers(module, lambda f: inspect.isfunction(f) and f.__module__ == module.__name__)
    name = module.__name__.removeprefix("ndtheory.")
    return {f"{name}.{key}": f for key, f in own if not key.startswith("_") and key not in NO_FORMULAS}


FORMULAS = {
    **formulas(bounds),
    **formulas(energy_norms),
    **{f"{e.name} {key}": getattr(e, key) for e in EDITIONS for key in ("coercivity", "unit", "proved")},
    **{f.__name__: f for f in (minimum, maximum, absolute, sqrt)},
}
STRESS, SHARE = st.floats(0.01, 100), st.floats(0.001, 0.999)
FRICTION = st.one_of(st.just(0.0), st.floats(0.001, 10), SHARE)
DRAWN = {
    **dict.fromkeys(("m", "M", "C_R", "u", "y", "rho", "rho_min", "a", "b"), STRESS),
    **dict.fromkeys(("x", "kappa_1", "kappa_2", "P", "D", "Q"), FRICTION),
    **dict.fromkeys(("theta", "low", "high", "gain"), SHARE),
    "margin": st.just(1e-9),
}


def arguments(formula, values=DRAWN):
    """Values for the parameters of a formula, by name."""
    return [values[name] for name in inspect.signature(formula).parameters]


def listed(result):
    return list(result) if isinstance(result, tuple) else [result]


def test_the_formulas_with_branches_are_among_those_tried():
    of_bounds = {"inverse_G", "thresholds", "lower_end", "one_minus_square", "factor_and_rest"}
    of_energy = {"turning_theta", "worst_ratio", "one_minus_inside", "one_minus_square", "slope_inside"}
    of_energy |= {"friction_limit", "predicted_factor", "contraction_ends", "best_between"}
    assert {f"bounds.{name}" for name in of_bounds} | {f"energy_norms.{name}" for name in of_energy} <= set(FORMULAS)


# --- a scalar that writes JavaScript -------------------------------------------------------------------------------


class Written:
    """A name of one line of a script; what is done to it writes further lines."""

    def __init__(self, script, text):
        self.script, self.name = script, f"v{len(script)}"
        script.append(f"const {self.name} = {text};")

    def line(self, *words):
        return Written(self.script, " ".join(getattr(w, "name", w if isinstance(w, str) else repr(w)) for w in words))

    def __bool__(self):
        raise TypeError("a written scalar has no truth value")

    __hash__ = None
    __neg__ = lambda self: self.line("-", self)
    __and__ = lambda self, other: self.line(self, "&&", other)
    where = lambda self, a, b: self.line(self, "?", a, ":", b)

    def __pow__(self, power):
        return Written(self.script, f"Math.sqrt({self.name})") if power == 0.5 else self.line(self, "**", power)


def _infix(name, sign, mirrored=None):
    setattr(Written, f"__{name}__", lambda self, other: self.line(self, sign, other))
    if mirrored:
        setattr(Written, f"__{mirrored}__", lambda self, other: self.line(other, sign, self))


for _name, _sign in {"add": "+", "sub": "-", "mul": "*", "truediv": "/"}.items():
    _infix(_name, _sign, f"r{_name}")
for _name, _sign in {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "===", "ne": "!=="}.items():
    _infix(_name, _sign)


def quotient(a, b):
    """As IEEE arithmetic and JavaScript have it."""
    if b:
        return a / b
    return math.nan if a == 0 or math.isnan(a) else math.copysign(math.inf, a) * math.copysign(1, b)


COMPARED = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}
SIGNS = COMPARED | {"===": operator.eq, "!==": operator.ne, "&&": lambda a, b: a and b}
SIGNS |= {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": quotient, "**": operator.pow}


def run(script, given):
    """Carry out a script line by line."""
    known = {}
    read = lambda word: known[word] if word in known else float(word)
    for line in script:
        _, name, _, *words = line.removesuffix(";").split()
        if words[0].startswith("Math.sqrt("):
            square = read(words[0][len("Math.sqrt(") : -1])
            known[name] = math.sqrt(square) if square >= 0 else math.nan
        elif len(words) == 1:
            known[name] = given[words[0]] if words[0] in given else read(words[0])
        elif words[0] == "-":
            known[name] = -read(words[1])
        elif words[1] == "?":
            known[name] = read(words[2]) if read(words[0]) else read(words[4])
        else:
            known[name] = SIGNS[words[1]](read(words[0]), read(words[2]))
    return known


@cache
def written(formula):
    """The script of a formula, and the names of its results."""
    script = []
    names = list(inspect.signature(formula).parameters)
    results = listed(formula(*[Written(script, name) for name in names]))
    return script, names, [result.name if isinstance(result, Written) else result for result in results]


@pytest.mark.parametrize("formula", FORMULAS.values(), ids=FORMULAS)
@strategies.fewer(2)
@given(data=st.data())
def test_a_formula_written_as_javascript_gives_the_same_doubles(formula, data):
    """No Python `if` on a scalar is left: a written scalar raises where its truth is asked for."""
    script, names, results = written(formula)
    values = [data.draw(strategy, name) for strategy, name in zip(arguments(formula), names, strict=True)]
    known = run(script, dict(zip(names, values, strict=True)))
    got = [known.get(result, result) for result in results]
    try:
        assert got == listed(formula(*values))
    except ZeroDivisionError:
        assert not all(map(math.isfinite, got))


def test_a_written_scalar_has_no_truth_value():
    with pytest.raises(TypeError, match="no truth value"):
        energy_norms.contraction_interval(*(Written(script, name) for script in [[]] for name in ("rho", "k1", "k2")))


def test_both_branches_of_a_written_choice_are_there():
    script = []
    x = Written(script, "x")
    where(x > 0, lambda: 1 / x, 0)
    assert script == ["const v0 = x;", "const v1 = v0 > 0;", "const v2 = 1 / v0;", "const v3 = v1 ? v2 : 0;"]


# --- an interval ---------------------------------------------------------------------------------------------------


class Undecided:
    """A comparison that holds for some of the numbers in question and fails for others."""

    def __bool__(self):
        raise TypeError("undecided")

    def where(self, a, b):
        a, b = Ball.of(a), Ball.of(b)
        return Ball(min(a.lo, b.lo), max(a.hi, b.hi))

    def __and__(self, other):
        return self if isinstance(other, Undecided) or other else False

    __rand__ = __and__


def decided(holds, fails):
    return True if holds else False if fails else Undecided()


class Ball:
    """All numbers from lo to hi, with outward rounding by mpmath."""

    def __init__(self, lo, hi):
        self.lo, self.hi = (mpf(end) if end == end else mpf(side) for end, side in ((lo, "-inf"), (hi, "inf")))

    @classmethod
    def of(cls, value):
        return value if isinstance(value, Ball) else cls(value, value)

    @property
    def interval(self):
        return iv.mpf([self.lo, self.hi])

    def __neg__(self):
        return Ball(-self.hi, -self.lo)

    def __pow__(self, power):
        if power == 0.5:
            root = iv.sqrt(iv.mpf([max(self.lo, 0), self.hi]))
            return Ball(root.a, root.b)
        result = self.interval**power
        return Ball(result.a, result.b)

    __hash__ = None
    __lt__ = lambda self, other: decided(self.hi < Ball.of(other).lo, self.lo >= Ball.of(other).hi)
    __gt__ = lambda self, other: Ball.of(other) < self
    __le__ = lambda self, other: decided(self.hi <= Ball.of(other).lo, self.lo > Ball.of(other).hi)
    __ge__ = lambda self, other: Ball.of(other) <= self

    def __eq__(self, other):
        other = Ball.of(other)
        point = self.lo == self.hi == other.lo == other.hi
        return decided(point, self.hi < other.lo or other.hi < self.lo)

    def __ne__(self, other):
        same = self == other
        return same if isinstance(same, Undecided) else not same


def _of_intervals(name, operation):
    def carry_out(a, b):
        result = operation(Ball.of(a).interval, Ball.of(b).interval)
        return Ball(result.a, result.b)

    setattr(Ball, f"__{name}__", carry_out)
    setattr(Ball, f"__r{name}__", lambda self, other: carry_out(other, self))


for _name in ("add", "sub", "mul", "truediv"):
    _of_intervals(_name, getattr(operator, _name))


def test_an_undecided_condition_gives_the_hull_of_both_branches():
    x = Ball(1, 3)
    found = where(x > 2, lambda: 10 * x, 7)
    assert (found.lo, found.hi) == (7, 30)
    for condition, hull in ((x > 3, (7, 7)), (x >= 1, (10, 30))):
        found = Ball.of(where(condition, lambda: 10 * x, 7))
        assert (found.lo, found.hi) == hull


WIDTHS = st.one_of(st.just(0.0), st.floats(0, 0.5), st.floats(1e-9, 1e-3))


@pytest.mark.parametrize("formula", FORMULAS.values(), ids=FORMULAS)
@strategies.fewer(4)
@given(data=st.data())
def test_the_interval_of_a_formula_contains_its_value_at_every_point(formula, data):
    low = [data.draw(strategy) for strategy in arguments(formula)]
    high = [value * (1 + data.draw(WIDTHS)) for value in low]
    shares = [data.draw(st.floats(0, 1)) for _ in low]
    found = listed(formula(*map(Ball, low, high)))
    with mp.workdps(50):
        point = [mpf(a) + mpf(share) * (mpf(b) - mpf(a)) for a, b, share in zip(low, high, shares, strict=True)]
        try:
            values = listed(formula(*point))
        except ZeroDivisionError:
            return
        for box, value in zip(found, values, strict=True):
            if isinstance(value, bool):
                assert isinstance(box, Undecided) or box == value
            else:
                assert Ball.of(box).lo <= value <= Ball.of(box).hi


@pytest.mark.parametrize("theta", [0.25, 0.5, 0.875])
def test_the_interval_of_q_is_narrow_also_where_the_branch_is_undecided(theta):
    """rho = 2 without friction: the branches meet at theta = 1/2, where 1 - q^2 = 3/4."""
    found = energy_norms.one_minus_square(Ball(theta - 1e-9, theta), Ball.of(2), Ball.of(0), Ball.of(0))
    assert found.hi - found.lo < 1e-7
    assert found.lo <= 1 - energy_norms.predicted_factor(theta, 2.0) ** 2 <= found.hi
