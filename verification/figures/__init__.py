"""Every plot: functions from results to matplotlib figures, without global state.

Each is imported from its module when first asked for: a figure loads what it draws.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure as Figure

if TYPE_CHECKING:
    from verification.figures.best_theta import draw_best_theta as draw_best_theta
    from verification.figures.bodies import draw_bodies as draw_bodies
    from verification.figures.factor import draw_factor as draw_factor
    from verification.figures.factor import draw_proved as draw_proved
    from verification.figures.history import draw_history as draw_history
    from verification.figures.proof_map import draw_map as draw_map
    from verification.figures.region import draw_region as draw_region
    from verification.figures.reproduction import draw_reproduction as draw_reproduction
    from verification.figures.residuals import draw_residuals as draw_residuals
    from verification.figures.ruler import draw_ruler as draw_ruler
    from verification.figures.squares import draw_squares as draw_squares
    from verification.figures.style import save as save
    from verification.figures.sweep import draw_rules as draw_rules
    from verification.figures.sweep import draw_sweep as draw_sweep
    from verification.figures.waterfall import draw_waterfall as draw_waterfall

#: The module of each name.
_HOME = {
    "draw_best_theta": "best_theta",
    "draw_bodies": "bodies",
    "draw_factor": "factor",
    "draw_history": "history",
    "draw_map": "proof_map",
    "draw_proved": "factor",
    "draw_region": "region",
    "draw_reproduction": "reproduction",
    "draw_residuals": "residuals",
    "draw_ruler": "ruler",
    "draw_rules": "sweep",
    "draw_squares": "squares",
    "draw_sweep": "sweep",
    "draw_waterfall": "waterfall",
    "save": "style",
}

__all__ = ["Figure", *_HOME]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'verification.figures' has no attribute {name!r}")
    return getattr(importlib.import_module(f"verification.figures.{_HOME[name]}"), name)
