"""Advice on the roles of two bodies and on theta."""

from typing import Literal

#: A body of the problem file.
BodyNumber = Literal[1, 2]

#: Methods of relaxation that advice compares, from the simplest one on.
METHODS = ("constant", "aitken", "iqn-ils")
