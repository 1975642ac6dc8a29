"""The constants of the theorem: measured on a mesh, and proved."""

from verification.constants.measured import Measured
from verification.constants.measuring import measure

__all__ = ["Measured", "measure"]
