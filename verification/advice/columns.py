"""The residuals of one field of a log: its time windows read one by one, and put together."""

from __future__ import annotations

from fractions import Fraction

from verification.advice.log import Column
from verification.advice.pace import MOST_WINDOWS, Pace, pace, pooled, together
from verification.advice.readings import FEWEST_STEPS, Observed, spread, steps_needed
from verification.advice.seen import SeenColumn


def seen_column(column: Column, theta: Fraction) -> SeenColumn:
    """Windows of one field, read one by one and put together; those that are all too short are pooled."""
    steps = steps_needed(theta)
    long = [window for window in column.windows if len(window) > FEWEST_STEPS] or list(column.windows)
    paces = [
        pace(
            window,
            relative=column.residual == "relative",
            steps=steps,
            theta=float(theta),
            spread=float(spread(theta)),
            digits=column.digits,
            decimals=column.decimals,
        )
        for window in long[-MOST_WINDOWS:]
    ]
    short = all(one.kind == "short" for one in paces)
    pace_of_all = pooled(long[-MOST_WINDOWS:], relative=column.residual == "relative", steps=steps) if short else None
    return SeenColumn(
        name=column.name,
        residual=column.residual,
        paces=tuple(paces),
        windows=len(column.windows),
        ratio=_put_together([one for one in paces if one.kind != "plateau" and one.value is not None]),
        plateau=_put_together([one for one in paces if one.kind == "plateau"]),
        pooled=None if pace_of_all is None else _observed(pace_of_all),
    )


def _observed(numbers: tuple[float, float, float]) -> Observed:
    value, least, most = (Fraction(number) for number in numbers)
    return Observed(value=value, least=least, most=most)


def _put_together(paces: list[Pace]) -> Observed | None:
    """The ratio or plateau of several windows; a run that grows in some does so."""
    grows = [one for one in paces if one.kind != "plateau" and one.least is not None and one.least > 1]
    if not paces:
        return None
    return _observed(together(grows or paces))
