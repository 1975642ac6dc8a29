"""The gaps in the text of Section 6, and each way to read it, named before any run.

The text gives both rectangles, their moduli, nu = 0.3, k = 0.2, the displacement -0.015 mm of the upper body, and the
numbers of nodes of four meshes.  Its pictures are not in the text: it does not say where the upper body sits, nor
whether its top may slide.  Section 6 gives the Neumann problem to the first body, Section 3 to the second.

A half model and the exchanged moduli were added after the other readings had been run, because runs of an independent
code pointed to them.  Each is combined with all that was open before, so that no combination is picked by its result.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any, ClassVar, Literal

from ndtheory.keys import Part, key, says
from verification.problem import Problem
from verification.problem.examples import example

#: The left halves are left out: the left sides of both bodies lie on an axis of symmetry and do not move along x.
HALF = "half model"

#: Where the upper body, 1.2 mm long, begins on the lower one, 2 mm long.
POSITIONS: dict[str, Fraction] = {"centred": Fraction(2, 5), "left edges aligned": Fraction(0), HALF: Fraction(0)}

#: The part of the top that is moved down: the share of its length from the left.
MOVED: dict[str, Fraction] = {"whole top": Fraction(1), "left two thirds": Fraction(2, 3), "left half": Fraction(1, 2)}

#: The part that is moved is held along x, or not.
TOPS = ("clamped", "free to slide")

#: Young's moduli of the lower and the upper body, in MPa.
MODULI = {"as printed": (70000, 20000), "exchanged": (20000, 70000)}

LENGTH, DOWN = Fraction(6, 5), Fraction(-15, 1000)


@dataclass(frozen=True, kw_only=True)
class ModelReading(Part):
    """One way to read Section 6: a key of POSITIONS, of MOVED and of MODULI, and one of TOPS."""

    part: ClassVar[str] = "Reading"

    position: str = key("where the upper body sits, or `half model`")
    moved: str = key("which part of its top is moved")
    top: str = key("whether that may slide")
    neumann_body: Literal[1, 2] = key("1 as in Section 6, 2 as in Section 3", type="integer", unit="")
    moduli: str = key("`as printed`, or `exchanged`: the upper body has the larger one")

    @property
    @says("in a few words")
    def name(self) -> str:
        moved = self.moved if self.moved == "whole top" else f"{self.moved} of the top"
        role = f"Neumann body {'lower' if self.neumann_body == 1 else 'upper'}"
        exchanged = "" if self.moduli == "as printed" else ", moduli exchanged"
        return f"{self.position}, {moved} {self.top}, {role}{exchanged}"

    @property
    @says("where it contradicts the text")
    def departs(self) -> list[str]:
        departures = {
            "the left sides of both bodies lie on an axis of symmetry": self.position == HALF,
            f"only the {self.moved} of the top is moved": self.moved != "whole top",
            "the roles of the bodies are those of Section 3": self.neumann_body == 2,
            "the moduli are exchanged": self.moduli == "exchanged",
        }
        return [text for text, departs in departures.items() if departs]

    @property
    @says("what it assumes where the text is silent")
    def assumes(self) -> list[str]:
        positions = {"centred": ["the upper body is centred"], HALF: []}
        return [*positions.get(self.position, [self.position]), f"top {self.top}"]

    def problem(self, nodes: int = 60) -> Problem:
        """The problem on the mesh with 60, 190, 666 or 2482 nodes."""
        start = POSITIONS[self.position]
        ends = [start, start + LENGTH]
        down: list[Any] = [0 if self.top == "clamped" else "free", DOWN]
        keys: dict[str, Any] = {"x": ends}
        if self.moved == "whole top":
            keys["prescribed"] = {"top": down}
        else:
            keys["parts"] = {"moved": {"side": "top", "x": [start, start + MOVED[self.moved] * LENGTH]}}
            keys["prescribed"] = {"moved": down}
        base = example(f"section6-{nodes}").to_dict()
        base["title"] = f"Section 6, {self.name}, {nodes} nodes"
        base["body2"] = {key: value for key, value in base["body2"].items() if key != "prescribed"} | keys
        if self.position == HALF:
            on_axis = {"left": [0, "free"]}
            base["body1"]["prescribed"] = on_axis
            base["body2"]["prescribed"] = keys["prescribed"] | on_axis
        base["body1"]["young"], base["body2"]["young"] = MODULI[self.moduli]
        base["iteration"]["neumann_body"] = self.neumann_body
        return Problem.from_dict(base)


#: Every combination; nothing was left out after a run.
READINGS: tuple[ModelReading, ...] = tuple(
    ModelReading(position=position, moved=moved, top=top, neumann_body=role, moduli=moduli)  # type: ignore[arg-type]
    for moduli, moved, role, position, top in product(MODULI, MOVED, (1, 2), POSITIONS, TOPS)
)
