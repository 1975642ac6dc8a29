"""Which body gets the Neumann problem, and which theta."""

from typing import Literal

#: A body of the problem file.
BodyNumber = Literal[1, 2]
