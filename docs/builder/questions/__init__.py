"""The question and the picture to move at the head of an example page, for pages without a script of their own.

Each page has a module with ``LABEL``, what a screen reader says of the picture, and ``data``, which makes the widget
with the functions of :mod:`builder.scenes`.
"""

from importlib import import_module
from types import ModuleType

#: The pages, by name.
PAGES = (
    *("open_or_closed", "which_side", "constants", "friction", "theorem_and_experiment", "prediction"),
    *("grids", "constant_theta", "best_theta", "beyond_constant", "other_code"),
)

#: Questions further down on a page, by name, with their page.
FURTHER = {"ruler": "theorem_and_experiment"}


def of(page: str) -> ModuleType:
    """The module of a page."""
    return import_module(f"builder.questions.{page}")
