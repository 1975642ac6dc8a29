"""The problem file: what may be asked, read and checked."""

from verification.problem.specification import Problem, Settings, load
from verification.problem.tables import ProblemError

__all__ = ["Problem", "ProblemError", "Settings", "load"]
