"""The oracle of the theorem in energy norms: a search in 160 digits, comparisons with it, and cases to compare."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction as F
from functools import cached_property, lru_cache, partial

import oracle
import strategies
from hypothesis import strategies as st
from mpmath import mp, mpf

from ndtheory import EnergyConstants, energy_norms, evaluate_energy

DIGITS = 160
HALVINGS = 270  # 2^-270 = 5e-82
SECTIONS = 320  # 0.618^320 = 1e-67
ZERO = mpf(10) ** -60  # thetas as small as 1e-67 divide rounding errors of 1e-148: what vanishes is below 1e-80
LAST_PLACE = mpf("3e-16")  # relative: a double next to the number meant
MANY_DIGITS = mpf("1e-60")  # relative: what the oracle keeps


# --- the oracle ----------------------------------------------------------------------------------------------------


def golden(function: Callable[[mpf], mpf], low: mpf, high: mpf, enough: Callable[[mpf], bool] | None = None) -> mpf:
    """Where a function that falls and then rises is least, or the first place found where it is low enough."""
    share = (mp.sqrt(5) - 1) / 2
    left, right = high - share * (high - low), low + share * (high - low)
    at_left, at_right = function(left), function(right)
    for _ in range(SECTIONS):
        if enough is not None and enough(min(at_left, at_right)):
            return left if at_left < at_right else right
        if at_left < at_right:
            high, right, at_right = right, left, at_left
            left = high - share * (high - low)
            at_left = function(left)
        else:
            low, left, at_left = left, right, at_right
            right = low + share * (high - low)
            at_right = function(right)
    return (low + high) / 2


def halve(holds: Callable[[mpf], bool], yes: mpf, no: mpf) -> mpf:
    """The point between `yes` and `no` where a condition ceases to hold."""
    for _ in range(HALVINGS):
        middle = (yes + no) / 2
        yes, no = (middle, no) if holds(middle) else (yes, middle)
    return yes


def summit(quadratic: Callable, end):
    """Where a quadratic is largest on [0, end], at an end or at its vertex, and its value there.

    Three values of the quadratic, which are dear, tell all others.
    """
    at_0, at_1, at_2 = quadratic(0), quadratic(1), quadratic(2)
    bend = at_2 - 2 * at_1 + at_0
    slope = at_1 - at_0 - bend / 2
    inside = [-slope / bend] if bend < 0 and 0 < -slope / bend < end else []
    value = lambda x: at_0 + x * (slope + x * bend / 2)
    return max(((x, value(x)) for x in [0 * end, end, *inside]), key=lambda found: found[1])


def work(x, kappa_1, kappa_2):
    """What friction may add, less the energy of the contact body."""
    return kappa_2 + kappa_1 * x - x * x


def right_side(x, theta, rho, kappa_1, kappa_2):
    """Of (5.24): two squares and twice a product."""
    kept = 1 - theta
    return kept * kept + 2 * kept * theta * work(x, kappa_1, kappa_2) + theta * theta * rho * x * x


@dataclass(frozen=True)
class Energy:
    """``q(theta)^2``, the largest right-hand side of (5.24), and what is found from it by searching."""

    rho: mpf
    kappa_1: mpf
    kappa_2: mpf

    @property
    def data(self) -> tuple[mpf, mpf, mpf]:
        return self.rho, self.kappa_1, self.kappa_2

    @cached_property
    def ratio(self) -> mpf:
        """The largest x with x^2 <= (sqrt(rho) + kappa_1) x + kappa_2."""
        roots = mp.polyroots([1, -mp.sqrt(self.rho) - self.kappa_1, -self.kappa_2], maxsteps=500, extraprec=500)
        return max(map(mp.re, roots))

    def summit(self, theta: mpf) -> tuple[mpf, mpf]:
        return summit(lambda x: right_side(x, theta, *self.data), self.ratio)

    def worst(self, theta: mpf) -> mpf:
        return self.summit(theta)[0]

    def square(self, theta: mpf) -> mpf:
        """q(theta)^2."""
        return self.summit(theta)[1]

    def excess(self, theta: mpf) -> mpf:
        """(q^2 - 1)/theta: at each x a line in theta, so convex."""
        return (self.square(theta) - 1) / theta

    def contracts(self, theta: mpf) -> bool:
        return bool(self.excess(theta) < -ZERO)

    @cached_property
    def largest_work(self) -> mpf:
        return summit(partial(work, kappa_1=self.kappa_1, kappa_2=self.kappa_2), self.ratio)[1]

    @cached_property
    def interval(self) -> tuple[mpf, mpf] | None:
        """Where q < 1 in (0, 1)."""
        inside = golden(self.excess, mpf(0), mpf(1), enough=lambda value: value < -ZERO)
        if not self.contracts(inside):
            return None
        low = mpf(0) if self.largest_work < 1 + ZERO else halve(self.contracts, inside, mpf(0))
        return low, mpf(1) if self.excess(mpf(1)) <= 0 else halve(self.contracts, inside, mpf(1))

    @cached_property
    def best(self) -> mpf | None:
        """The theta of least q."""
        return None if self.interval is None else golden(self.square, *self.interval)

    @cached_property
    def turning(self) -> mpf:
        """The theta from which on the worst x is r."""
        return halve(lambda theta: self.worst(theta) < self.ratio, mpf(0), mpf(1))

    @cached_property
    def friction_multiple(self) -> mpf | None:
        """The t for which the largest work of t kappa_1, t kappa_2 is 1."""
        if self.kappa_1 == self.kappa_2 == 0:
            return None
        missing = lambda t: replace(self, kappa_1=t * self.kappa_1, kappa_2=t * self.kappa_2).largest_work - 1
        most = mpf(1)
        while missing(most) <= 0:
            most *= 4
        return mp.findroot(missing, (mpf(0), most), solver="anderson", tol=MANY_DIGITS**2)


@lru_cache(maxsize=256)
def energy(*, rho, kappa_1=0, kappa_2=0, rho_normal=None) -> Energy:
    """Without friction tangential components carry no force: then rho_normal counts, where it is known."""
    slides = rho_normal is not None and kappa_1 == kappa_2 == 0
    return Energy(*map(oracle.real, (rho_normal if slides else rho, kappa_1, kappa_2)))


# --- comparisons ---------------------------------------------------------------------------------------------------

FIELDS = [
    *("interval", "theta", "factor", "one_minus_factor", "verdict"),
    *("rho", "kappa_1", "kappa_2", "ratio", "friction_multiple", "friction_limit_multiple"),
    *("theta_proved", "factor_proved", "theta_max_proved", "theta_predicted", "rate_predicted"),
]


def close(got, want, tolerance=LAST_PLACE) -> bool:
    """Equal but for the last place; None only beside None, and a pair member by member."""
    if got is None or want is None or isinstance(want, str):
        return got == want
    if isinstance(want, tuple):
        return all(map(close, got, want))
    return bool(abs(oracle.real(getattr(got, "value", got)) - want) <= tolerance * abs(want))


@lru_cache(maxsize=256)
def predicted(rho: mpf) -> tuple[mpf, mpf]:
    """The best theta without friction and q there."""
    alone = Energy(rho, mpf(0), mpf(0))
    theta = golden(alone.square, mpf(0), mpf(1))
    return theta, mp.sqrt(alone.square(theta))


def wanted(constants, theta=None) -> dict:
    """Every field of the answer, found by the oracle."""
    found = energy(**constants)
    q = None
    if theta is not None:
        theta = oracle.real(theta)
        q = mp.sqrt(found.square(theta)) if found.contracts(theta) else None
    return {
        **dict(zip(("rho", "kappa_1", "kappa_2"), found.data, strict=True)),
        "ratio": found.ratio,
        "friction_multiple": found.friction_multiple,
        "interval": found.interval,
        "theta_proved": found.best,
        "factor_proved": None if found.best is None else mp.sqrt(found.square(found.best)),
        "theta_max_proved": None if found.interval is None else found.interval[1],
        **dict(zip(("theta_predicted", "rate_predicted"), predicted(found.rho), strict=True)),
        "theta": theta,
        "factor": q,
        "one_minus_factor": None if q is None else 1 - q,
        "verdict": None if theta is None else "no conclusion" if q is None else "contraction",
    }


def differences(constants, theta=None) -> list[str]:
    """Names of the fields in which `evaluate_energy` departs from the oracle."""
    found = evaluate_energy(EnergyConstants(**constants), theta)
    return [name for name, want in wanted(constants, theta).items() if not close(getattr(found, name), want)]


def formula_differences(constants, theta) -> list[str]:
    """Names of the formulas that, in 160 digits, depart from the oracle."""
    found, t = energy(**constants), oracle.real(theta)
    data, friction = found.data, found.data[1:]
    x, branch = found.ratio / 3, "one_minus_inside" if t < found.turning else "one_minus_end"
    values = {
        "largest_ratio": (data, found.ratio),
        "work": ((x, *friction), work(x, *friction)),
        "square_at": ((x, t, *data), right_side(x, t, *data)),
        "turning_theta": (data, found.turning),
        "worst_ratio": ((t, *data), found.worst(t)),
        branch: ((t, *data), 1 - found.square(t)),
        "one_minus_square": ((t, *data), 1 - found.square(t)),
        "friction_number": (friction, found.largest_work),
        "predicted_theta": ((data[0],), predicted(data[0])[0]),
        "predicted_rate": ((data[0],), predicted(data[0])[1]),
        "predicted_factor": ((t, data[0]), mp.sqrt(Energy(data[0], mpf(0), mpf(0)).square(t))),
    }
    if found.friction_multiple is not None:
        values["friction_multiple"] = (friction, found.friction_multiple)
    if t < found.turning:
        step = t * MANY_DIGITS
        rise = found.square(t - step) - found.square(t + step)
        values["slope_inside"] = ((t, *data), rise / (2 * step))
    return [
        name
        for name, (arguments, want) in values.items()
        if not abs(getattr(energy_norms, name)(*arguments) - want) <= mpf("1e-30") * max(abs(want), ZERO)
    ]


# --- cases ---------------------------------------------------------------------------------------------------------

RHO = strategies.log_uniform(-6, 6)
ANY_KAPPA = st.one_of(st.just(F(0)), strategies.log_uniform(-9, 3), strategies.log_uniform(-2, 0.3))
SHARES = st.fractions(0, 1, max_denominator=100)


@st.composite
def near_threshold(draw):
    """kappa_1, kappa_2 with kappa_2 + kappa_1^2/4 next to 1."""
    number, share = 1 + draw(strategies.offsets()), draw(SHARES)
    return oracle.rational(2 * mp.sqrt(oracle.real(share * number)), 40), (1 - share) * number


@st.composite
def energies(draw):
    """Admissible constants: with and without friction, few or many digits, rho_normal known or not."""
    rho = draw(RHO)
    none = st.just((F(0), F(0)))
    kappa_1, kappa_2 = draw(st.one_of(none, st.tuples(ANY_KAPPA, ANY_KAPPA), near_threshold()))
    normal = draw(st.one_of(st.none(), st.integers(1, 100).map(lambda n: rho * F(n, 100))))
    return {"rho": rho, "kappa_1": kappa_1, "kappa_2": kappa_2, "rho_normal": normal}


def inside(theta: F, end: F) -> F:
    """theta, or if that is not below 1 its mirror image on the other side of `end`."""
    return theta if theta < 1 else end * end / theta


@st.composite
def cases(draw):
    """Constants, and 0 < theta < 1 anywhere or next to an end of the interval, the turning or the best theta."""
    constants = draw(energies())
    found, place = energy(**constants), draw(st.sampled_from(["anywhere", "low end", "high end", "turning", "best"]))
    if place == "anywhere":
        return constants, draw(strategies.thetas())
    if place == "turning" or found.interval is None:
        end = found.turning
    else:
        end = found.best if place == "best" else found.interval[place == "high end"] or found.interval[1]
    end = oracle.rational(end, 70)
    return constants, inside(end * (1 + draw(strategies.offsets())), end)


ANY_ROOT = st.one_of(strategies.log_uniform(-3, 3), st.integers(1, 12).map(lambda n: F(n, 4)))


@st.composite
def rational_ratios(draw, s=ANY_ROOT):
    """sqrt(rho), kappa_1, kappa_2 and r, all rational: kappa_2 = r (r - sqrt(rho) - kappa_1)."""
    root, kappa_1 = draw(s), draw(ANY_KAPPA)
    ratio = root + kappa_1 + draw(ANY_KAPPA)
    return root, kappa_1, ratio * (ratio - root - kappa_1), ratio
