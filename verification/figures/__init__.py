"""Every plot: functions from results to matplotlib figures, without global state."""

from matplotlib.figure import Figure

from verification.figures.best_theta import draw_best_theta
from verification.figures.bodies import draw_bodies
from verification.figures.factor import draw_factor, draw_proved
from verification.figures.history import draw_history
from verification.figures.proof_map import draw_map
from verification.figures.region import draw_region
from verification.figures.reproduction import draw_reproduction
from verification.figures.residuals import draw_residuals
from verification.figures.ruler import draw_ruler
from verification.figures.squares import draw_squares
from verification.figures.style import save
from verification.figures.sweep import draw_rules, draw_sweep
from verification.figures.waterfall import draw_waterfall

__all__ = [
    "Figure",
    "draw_best_theta",
    "draw_bodies",
    "draw_factor",
    "draw_history",
    "draw_map",
    "draw_proved",
    "draw_region",
    "draw_reproduction",
    "draw_residuals",
    "draw_ruler",
    "draw_rules",
    "draw_squares",
    "draw_sweep",
    "draw_waterfall",
    "save",
]
