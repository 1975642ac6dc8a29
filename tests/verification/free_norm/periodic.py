"""Two layers of finite elements whose sides are identified: periodic meshes, in contact at every node."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
import scipy.sparse as sp
from scipy.linalg import eigh

import verification as vf
from fem1d2d import Material, assembly, plane_strain, rectangle
from fem1d2d.condense import Condensation
from fem1d2d.layers import FacingLayers, Layer
from ndtheory.continuum.circle import TwoLayers
from ndtheory.continuum.strip import Strip
from ndtheory.moduli import Moduli
from verification.interface.friction import hat
from verification.interface.pair import ContactPair


def surface(material: Material, columns: int, rows: int, cell: tuple[float, float]) -> np.ndarray:
    """The stiffness of the upper surface of a layer that is clamped below, shape (2 columns, 2 columns), unit stress.

    Tangential components first.  ``cell`` is width and height of a cell; ``columns`` is even, as diagonals alternate.
    """
    mesh = rectangle((0.0, columns * cell[0]), (0.0, rows * cell[1]), (columns, rows))
    column, row = np.divmod(np.arange(len(mesh.points)), rows + 1)
    place = 2 * (column % columns * rows + row - 1)[:, None] + [0, 1]  # both sides have the unknowns of the left one
    free = np.flatnonzero(np.repeat(row > 0, 2))
    onto = sp.csc_array((np.ones(len(free)), (free, place.ravel()[free])), shape=(place.size, 2 * columns * rows))
    matrix = (onto.T @ assembly.stiffness(mesh, material) @ onto).tocsc()
    return Condensation(matrix, place[(row == rows) & (column < columns)].T.ravel()).schur


@dataclass(frozen=True, kw_only=True)
class Side:
    """A layer: E, nu and thickness."""

    young: float
    poisson: float
    depth: float

    @property
    def strip(self) -> Strip:
        """The layer without a mesh."""
        exact = (Fraction(str(value)) for value in (self.young, self.poisson, self.depth))
        return Strip(body=Moduli(young=next(exact), poisson=next(exact)), thickness=next(exact))


@dataclass(frozen=True, kw_only=True)
class Periodic:
    """Two layers and a periodic mesh of both, whose cells are as near to squares as their depths allow.

    Attributes
    ----------
    contact, neumann : Side
    period, radius : float
        Unit length.
    columns : int
        Cells in one period, an even number.
    """

    contact: Side
    neumann: Side
    period: float
    radius: float
    columns: int

    @property
    def width(self) -> float:
        return self.period / self.columns

    def rows(self, side: Side) -> int:
        return max(1, round(side.depth / self.width))

    @property
    def kernel(self) -> np.ndarray:
        """S for nodal forces that repeat: the sum of the hat over all images of a node, shape (columns, columns)."""
        away = self.width * np.subtract.outer(np.arange(self.columns), np.arange(self.columns))
        most = np.ceil(self.radius / self.period) + 1
        return sum(hat(away - image * self.period, self.radius) for image in np.arange(-most, most + 1))

    def stiffness(self, side: Side) -> np.ndarray:
        """Of the upper surface of a layer."""
        rows = self.rows(side)
        return surface(plane_strain(side.young, side.poisson), self.columns, rows, (self.width, side.depth / rows))

    def pair(self, friction: float) -> ContactPair:
        """Both layers in contact at every node; the Neumann layer lies above, and its cells are the mirror image."""
        n = self.columns
        turn = np.repeat([1.0, -1.0], n)
        return vf.build(
            S1=self.stiffness(self.contact),
            S2=self.stiffness(self.neumann) * np.outer(turn, turn),
            x=self.width * np.arange(n),
            weights=np.full(n, self.width),
            kernel=self.kernel,
            friction=friction,
        )

    @property
    def cells(self) -> FacingLayers:
        """The cells of both layers, whatever the period; their node 0 is that of the mesh."""
        layers = {
            role: Layer(
                material=plane_strain(side.young, side.poisson),
                aspect=self.width * self.rows(side) / side.depth,
                rising=self.rows(side) % 2 == 1,  # the diagonal in the corner at the lower left rises
                rows=self.rows(side),
            )
            for role, side in (("contact", self.contact), ("neumann", self.neumann))
        }
        return FacingLayers(**layers)

    @property
    def phases(self) -> np.ndarray:
        """The phases of two columns that the period allows, 0 to pi, shape (columns // 4 + 1,)."""
        return 4 * np.pi * np.arange(self.columns // 4 + 1) / self.columns

    @property
    def layers(self) -> TwoLayers:
        """Both layers without a mesh."""
        return TwoLayers(contact=self.contact.strip, neumann=self.neumann.strip, radius=Fraction(str(self.radius)))

    @property
    def swapped(self) -> Periodic:
        return replace(self, contact=self.neumann, neumann=self.contact)


#: The layers of Section 6 with its cells, the harder one as Neumann body.
SECTION_6 = Periodic(
    contact=Side(young=20000, poisson=0.3, depth=0.3),
    neumann=Side(young=70000, poisson=0.3, depth=0.3),
    period=0.6,
    radius=0.1,
    columns=12,
)


def drawn(seed: int, columns: Sequence[int] = (6, 8, 10)) -> tuple[Periodic, float, float]:
    """Two layers on a mesh of period 1, a friction, and a theta at which they would contract without it."""
    random = np.random.default_rng(seed)
    n = int(random.choice(columns))
    sides = [
        Side(
            young=round(10 ** random.uniform(-1, 1), 3),
            poisson=float(random.choice([0.0, 0.2, 0.3, 0.45])),
            depth=round(random.uniform(0.1, 1.5), 2),
        )
        for _ in range(2)
    ]
    radius = round(random.uniform(0.1, 0.6), 2)
    mesh = Periodic(contact=sides[0], neumann=sides[1], period=1.0, radius=radius, columns=n)
    rho = float(eigh(mesh.stiffness(mesh.contact), mesh.stiffness(mesh.neumann), eigvals_only=True)[-1])
    theta = float(f"{random.uniform(0.1, 0.9) * min(2 / (1 + rho), 1.0):.3g}")
    return mesh, round(10 ** random.uniform(-1.5, 0.3), 3), theta
