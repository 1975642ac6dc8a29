"""Proposition 5.6 beside the formulas of the paper in 400 digits."""

import oracle
import pytest
from mpmath import mp, mpf

from ndtheory import PRINTED, REPAIRED, Constants, evaluate

EDITIONS = {"printed": PRINTED, "repaired": REPAIRED}
in_both_editions = pytest.mark.parametrize("edition", EDITIONS.values(), ids=EDITIONS)

THRESHOLDS = ["C2", "C3", "C4", "C5"]
TOLERANCE = mpf("1e-12")


def close(got, want, scale=None) -> bool:
    """|got - want| <= 1e-12 |want|, or 1e-12 `scale` where given; None only beside None."""
    if got is None or want is None:
        return got is want
    with mp.workdps(oracle.DIGITS):
        got = oracle.real(getattr(got, "value", got))
        return bool(abs(got - want) <= TOLERANCE * abs(want if scale is None else scale))


def differences(edition, constants, theta=None) -> list[str]:
    """Where `evaluate` departs from the paper: names of fields, empty where all agree."""
    paper = oracle.EDITIONS[edition.name](**constants)
    found = evaluate(edition, Constants(**constants), theta)
    wanted = {name: getattr(paper, name) for name in ["C_K", "C_T", "C0", "C1", "C6"]}
    wanted |= {name: paper.threshold(name) for name in THRESHOLDS}
    if edition is PRINTED:
        wanted["C_T_tilde"] = paper.C_T_tilde
    contracts = theta is not None and paper.contracts(theta)
    with mp.workdps(oracle.DIGITS):
        wanted["factor"] = paper.K(theta) if contracts else None
        wanted["one_minus_factor"] = 1 - paper.K(theta) if contracts else None
    wrong = [name for name, want in wanted.items() if not close(getattr(found, name), want)]
    if theta is not None and found.verdict != ("contraction" if contracts else "no conclusion"):
        wrong.append("verdict")
    lo, hi = found.interval or (None, None)
    ends = (max(mpf(0), paper.C6 or mpf(0)), paper.C1) if paper.below("C2") else (None, None)
    if not (close(lo, ends[0]) and close(hi, ends[1])):
        wrong.append("interval")
    return wrong


def read(edition, constants):
    """The arguments (x, m~, M, C_R) and u of the generic formulas, in the arithmetic of the constants."""
    m, M, C_R, x = (constants[name] for name in ("m", "M", "C_R", "C_K"))
    scalar = type(m)
    return (x, scalar(edition.coercivity(m)), M, C_R), scalar(edition.unit(m))
