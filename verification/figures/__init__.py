"""Every plot: functions from results to matplotlib figures, without global state.

Each is imported from its module when first asked for: a figure loads what it draws.
"""

from __future__ import annotations

import importlib
from typing import Any

from matplotlib.figure import Figure as Figure

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
