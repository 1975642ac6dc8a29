"""Elastic bodies on meshes: P1 on intervals and triangles, plane strain and stress, condensed onto an interface.

A small core in which every matrix is exact for its mesh.  Contact and the theorem do not enter.
"""

from fem1d2d.assembly import body_load, facet_weights, gram, stiffness
from fem1d2d.condense import (
    FEW,
    Condensation,
    Lifted,
    Response,
    Uncoupled,
    elimination_order,
    solver,
    solver_with_inertia,
)
from fem1d2d.element import largest_strains, stresses, von_mises
from fem1d2d.line import Line, Seen, smooth
from fem1d2d.material import Material, bar, plane_strain, plane_stress
from fem1d2d.mesh import Mesh, MeshError, crossed, interval, rectangle, rectangle_points, sector
from fem1d2d.mesh_files import from_file
from fem1d2d.outline import depths
from fem1d2d.pencil import Eigenvalue, Extremes, extremes_by_solves, largest, largest_of, largest_sparse
from fem1d2d.places import Place, means_at_nodes, node_at, place
from fem1d2d.supports import Supports, pieces, rigid_motions, supports
from fem1d2d.trace import facing, mortar, surface, trapezoid

__all__ = [
    "FEW",
    "Condensation",
    "Eigenvalue",
    "Extremes",
    "Lifted",
    "Line",
    "Material",
    "Mesh",
    "MeshError",
    "Place",
    "Response",
    "Seen",
    "Supports",
    "Uncoupled",
    "bar",
    "body_load",
    "crossed",
    "depths",
    "elimination_order",
    "extremes_by_solves",
    "facet_weights",
    "facing",
    "from_file",
    "gram",
    "interval",
    "largest",
    "largest_of",
    "largest_sparse",
    "largest_strains",
    "means_at_nodes",
    "mortar",
    "node_at",
    "pieces",
    "place",
    "plane_strain",
    "plane_stress",
    "rectangle",
    "rectangle_points",
    "rigid_motions",
    "sector",
    "smooth",
    "solver",
    "solver_with_inertia",
    "stiffness",
    "stresses",
    "supports",
    "surface",
    "trapezoid",
    "von_mises",
]
