"""Advice on the roles of two bodies and on theta."""

from typing import Literal

#: A body of the problem file.
BodyNumber = Literal[1, 2]
