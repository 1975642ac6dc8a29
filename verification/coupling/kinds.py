"""Words that all of the advice uses: bodies, kinds of coupling, methods."""

from dataclasses import dataclass
from typing import Literal

#: A body of the problem file.
BodyNumber = Literal[1, 2]

#: Methods of relaxation that advice compares, from the simplest one on.
METHODS = ("constant", "aitken", "iqn-ils")


@dataclass(frozen=True, kw_only=True)
class Kind:
    """The kind of a coupling, which only its user knows: it says what is known of the eigenvalues of H beforehand.

    ``contact`` has eigenvalues >= 0, and 0 for an open node; ``tied`` has eigenvalues >= 0, and nothing opens or slips;
    ``general`` may have any.  With ``parallel`` both solvers run at once, each on the old data of the other.
    """

    name: Literal["contact", "tied", "general"] = "contact"
    parallel: bool = False

    @property
    def tied(self) -> bool:
        """True if nothing opens or slips."""
        return self.name == "tied"


CONTACT = Kind()


def kind_of(*, tied: bool, parallel: bool = False) -> Kind:
    """The kind of a coupling of two bodies."""
    return Kind(name="tied" if tied else "contact", parallel=parallel)
