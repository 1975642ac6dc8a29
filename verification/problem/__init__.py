"""The problem file: what may be asked, read, checked, changed and written."""

from verification.problem.examples import example
from verification.problem.files import load
from verification.problem.specification import Problem
from verification.problem.specs import MeshFile, Settings
from verification.problem.tables import ProblemError

__all__ = ["MeshFile", "Problem", "ProblemError", "Settings", "example", "load"]
