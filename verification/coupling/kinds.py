"""Words that all of the advice uses: bodies, kinds of coupling, methods."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Literal, get_args

#: A body of the problem file.
BodyNumber = Literal[1, 2]

#: Methods of relaxation that advice compares, from the simplest one on.
METHODS = ("constant", "aitken", "iqn-ils")

KindName = Literal["contact", "tied", "general"]

#: The largest theta that is offered to paste where no eigenvalue is below 0, and of a run; both of any kind.
LARGEST_TO_PASTE, LARGEST_RUN, ANY_THETA = Fraction(99, 100), Fraction(1), Fraction(100)


@dataclass(frozen=True, kw_only=True)
class Kind:
    """The kind of a coupling, which only its user knows: it says what is known of the eigenvalues of H beforehand.

    ``contact`` has eigenvalues >= 0, and 0 for an open node; ``tied`` has eigenvalues >= 0, and nothing opens or slips;
    ``general`` may have any, of which those between -1 and 0 are *positive feedback*: T keeps the sign.  With
    ``parallel`` both solvers run at once, each on the old data of the other.
    """

    name: KindName = "contact"
    parallel: bool = False

    @property
    def linear(self) -> bool:
        """True if nothing opens or slips, so that zeros are data."""
        return self.name != "contact"

    def given(self, words: str) -> str:
        """Words for what must hold where something may open or slip; empty where nothing does."""
        return "" if self.linear else words

    @property
    def signed(self) -> bool:
        """True if no eigenvalue is below 0."""
        return self.name != "general"

    @property
    def least(self) -> float:
        """The least eigenvalue that may be."""
        return 0.0 if self.signed else float("-inf")

    @property
    def most(self) -> Fraction:
        """The largest theta to paste."""
        return LARGEST_TO_PASTE if self.signed else ANY_THETA

    @property
    def longest(self) -> Fraction:
        """The largest theta that a run may have."""
        return LARGEST_RUN if self.signed else ANY_THETA

    @property
    def thetas(self) -> str:
        """The thetas that a run may have, in words."""
        return f"0 < theta <= {self.longest}"

    @property
    def typed(self) -> str:
        """The options of the command line, with a space behind each."""
        kind = {"contact": "", "tied": "--tied ", "general": "--kind general "}[self.name]
        return kind + "--parallel " * self.parallel

    def assumes(self, friction: bool) -> str:
        """The assumption under which runs of this kind are read; ValueError where there is no reading."""
        if friction and self.linear:
            raise ValueError(f"{self.name} with friction: needed one of them, as nothing slips on such an interface")
        if self.parallel and (friction or not self.signed):
            what = "friction" if friction else "kind general"
            needed = "needed vectors (ndtheory advise vectors), as residuals say nothing then"
            raise ValueError(f"parallel with {what}: {needed}")
        if friction:
            return "there is friction, with which no ratio of residuals bounds rho"
        if not self.signed:
            return "a linear coupling whose eigenvalues are real, and may be below 0"
        both = ", and both solvers run at once" * self.parallel
        return ("nothing opens or slips" if self.linear else "no friction, or a tied interface") + both


def kind_of(name: str | Kind | None = None, *, tied: bool = False, parallel: bool = False) -> Kind:
    """The kind of a coupling by its name, contact where there is none; ``tied`` is short for that name.

    ValueError where no kind has the name, or tied is beside another one.
    """
    if isinstance(name, Kind):
        return name
    if name is not None and name not in get_args(KindName):
        raise ValueError(f"kind = {name}: needed one of {', '.join(get_args(KindName))}")
    if tied and name not in (None, "tied"):
        raise ValueError(f"kind = {name} with tied: needed one of them, tied is short for kind = tied")
    return Kind(name="tied" if tied else name or "contact", parallel=parallel)  # type: ignore[arg-type]


CONTACT, TIED, GENERAL = Kind(), Kind(name="tied"), Kind(name="general")
