"""Advice from the data of two plates that exchange heat, or of a fluid and a wall, before there is a mesh."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from ndtheory import HypothesisError, Number
from ndtheory.constants import take
from ndtheory.energy_norms import tied_theta
from ndtheory.moduli import Wall, added_mass, conduction
from verification.coupling import methods
from verification.coupling.kinds import BodyNumber
from verification.coupling.readings import NextRun, or_at_one, rounded_down
from verification.coupling.roles import Advice, Role, plain_role, table_of
from verification.coupling.seen_moduli import WAVES_KEYS, Kind, Parallel, SeenWaves
from verification.coupling.spectrum import Spectrum
from verification.interface.pair import UNITS

#: Sizes of what is given: the ratios then stay far from the ends of doubles.
LARGEST, SMALLEST = 10**12, Fraction(1, 10**12)

#: So many waves of a wall stand for its spectrum in the predictions of methods.
WAVES = 40

#: Reason for everything that needs an upper bound of rho for a fluid at a wall.
ONE_WAVE = "one wave bounds rho from below"

#: Reason against the fluid as the Neumann body.
SHORT_WAVES = "short waves have less and less added mass, so that rho would grow without end as meshes are refined"


#: What each kind needs beside parameters that are given.
NEEDED = {
    "heat": (("dt", "capacity"), ("capacity thickness", "dt")),
    "fluid": (("", "thickness"), ("", "length"), ("young", "poisson"), ("young", "dt"), ("poisson", "young")),
}


def advise_waves(kind: Kind, given: dict[str, Any], *, parallel: bool) -> Advice:
    """The advice for plates that exchange heat, or for a fluid and a wall; ``given`` has what is not None.

    Raises
    ------
    HypothesisError
        A parameter that this kind does not have, one that is missing, or numbers out of their range.
    """
    first, counts = "conductivity" if kind == "heat" else "density", WAVES_KEYS[kind]
    for key in given:
        if key not in counts:
            raise HypothesisError(key, shown(given[key]), f"no {key} beside {first}")
    seen = SeenWaves(kind=kind, given={key: _numbers(key, value, counts[key]) for key, value in given.items()})
    for beside, key in NEEDED[kind]:
        if key not in given and given.keys() >= {*beside.split()}:
            raise HypothesisError(key, "nothing", f"{key} beside {beside.replace(' ', ' and ') or first}")
    return (_heat if kind == "heat" else _fluid)(seen, parallel)


def shown(value: Any) -> Any:
    """A parameter as it is typed."""
    return value if isinstance(value, str) or not hasattr(value, "__len__") else ",".join(map(str, value))


def _numbers(key: str, value: Any, counts: tuple[int, ...]) -> tuple[Fraction, ...]:
    several = value if hasattr(value, "__len__") and not isinstance(value, str) else [value]
    if len(several) not in counts:
        names = {1: "one number", 2: "two numbers, separated by a comma"}
        raise HypothesisError(key, shown(value), " or ".join(names[n] for n in counts))
    if key == "poisson":
        return (take(key, several[0], "a number with -1 < nu <= 1/2", lambda v: -1 < v <= Fraction(1, 2)),)
    return tuple(take(key, v, "numbers > 0 (1e-12 to 1e12)", lambda v: SMALLEST <= v <= LARGEST) for v in several)


def _heat(seen: SeenWaves, parallel: bool) -> Advice:
    """Heat: both ends of the spectrum, so that theta and its factor are known."""
    roles, both, products = [], [], []
    bodies: tuple[BodyNumber, ...] = (1, 2)
    for body in bodies:
        order = slice(None, None, 1 if body == 2 else -1)  # contact body, Neumann body
        pairs = {key: seen.given[key][order] for key in ("conductivity", "capacity", "thickness") if key in seen.given}
        low, high = conduction(pairs.pop("conductivity"), **pairs, dt=seen.one("dt"))
        if not 0 < low <= high < float("inf"):
            raise HypothesisError("dt", seen.one("dt"), "a step in time that heat does not outrun: plates are too thin")
        known: dict[str, Any] = {"rho_min": Number.of_float(low), "rho_tied": Number.of_float(high)}
        known |= {"spectrum": Spectrum.between(low, high), "reason": {}, "no_threshold": "heat has no friction"}
        roles.append(plain_role(body, Fraction(high), **known))
        both.append(Parallel.of(body, high))
        products.append(low * high)
    best = roles[products.index(min(products))]  # it has the smaller rate, too
    table = table_of(roles, tied=True) if not parallel else ()
    return Advice(
        neumann_body=best.neumann_body,
        roles=tuple(roles),
        units=UNITS,
        tied=True,
        waves=seen,
        parallel=tuple(both) if parallel else (),
        methods=table,
        method=methods.advised(table, tied=True, exchanged=best is not roles[0]),
    )


def _fluid(seen: SeenWaves, parallel: bool) -> Advice:
    """Added mass: a lower bound of rho with the Neumann problem on the wall, body 2."""
    length, *radius = seen.given["length"]
    wall = Wall(
        density=seen.given["density"][1],
        thickness=seen.given["thickness"][0],
        length=length,
        radius=radius[0] if radius else None,
        young=seen.one("young"),
        poisson=seen.one("poisson") or Fraction(0),
    )
    values = [added_mass(seen.given["density"][0], wall, dt=seen.one("dt"), wave=n) for n in range(1, WAVES + 1)]
    largest = max(values)
    theta = float(tied_theta(min(values), largest))
    rows = () if parallel else methods.rows(Spectrum.of(values), theta=theta, neumann_body=2, exchanged=False)
    names = [name for name in Role.__dataclass_fields__ if name not in ("neumann_body", "rho", "reason", "singular")]
    why = (
        f"1/(2 + {largest:.4g}), which contracts if rho is below {3 + 2 * largest:.4g}; halve it if the residual does "
        f"not fall{or_at_one(largest)}"
    )
    return Advice(
        neumann_body=2,
        roles=(
            Role(neumann_body=2, rho=Number.of_float(largest), reason=dict.fromkeys(names, ONE_WAVE)),
            Role(neumann_body=1, rho=None, reason=dict.fromkeys(("rho", *names), SHORT_WAVES)),
        ),
        units=UNITS,
        tied=True,
        waves=seen,
        next=NextRun(theta=rounded_down(1 / (2 + Fraction(largest))), why=why),
        parallel=(Parallel.of(2, largest, bound=True),) if parallel else (),
        methods=rows,
        method=methods.advised(rows, tied=True),
    )
