"""Words that all of the advice uses: bodies, roles, methods."""

from typing import Literal

#: A body of the problem file.
BodyNumber = Literal[1, 2]

#: Methods of relaxation that advice compares, from the simplest one on.
METHODS = ("constant", "aitken", "iqn-ils")
