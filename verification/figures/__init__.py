"""Every plot: functions from results to matplotlib figures, without global state."""

from verification.figures.bodies import draw_bodies
from verification.figures.residuals import draw_residuals
from verification.figures.style import save

__all__ = ["draw_bodies", "draw_residuals", "save"]
