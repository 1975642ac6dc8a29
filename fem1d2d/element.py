"""Element matrices, strains, stresses: P1 in closed form, one formula for floats and rationals; others by quadrature.

All arrays have the cells first.  d is the dimension, k the number of nodes of a cell.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fem1d2d.material import Material
from fem1d2d.mesh import Cells, Floats, Ints, Mesh, MeshError, crossed, measures


class Element(ABC):
    """Shape functions on the cells of a mesh, and their integrals; :data:`ELEMENTS` lists the elements in use.

    Matrices, loads, strains and stresses follow from them, for a material in each cell too.  What else an element
    supports it declares, and who needs that asks :func:`lacks`.

    Attributes
    ----------
    words : str
        Its cells, for messages.
    vtk : str
        What meshio calls its cells; empty where files for ParaView have none like them.
    supports : frozenset of str
        ``waves``: the layers of :mod:`fem1d2d.layers` are of its cells; ``proofs``: its matrices of rational meshes are
        rational, and the checker of certificates knows them; ``values``: its shape functions are linear, with
        :func:`gradients`, so that fields have values inside its cells.
    """

    words: str = "cells of another element"
    vtk: str = ""
    supports: ClassVar[frozenset[str]] = frozenset()

    def locks(self, mesh: Mesh) -> bool:
        """True if it is known to be too stiff on a mesh as Poisson's ratio comes near 1/2."""
        return False

    @abstractmethod
    def points(self, mesh: Cells) -> Sequence[tuple[NDArray[Any], NDArray[Any]]]:
        """For each quadrature point its share of the measure of each cell, (c,), and the gradients there, (c, k, d)."""

    @abstractmethod
    def mass(self, mesh: Cells) -> NDArray[Any]:
        """``int u v`` of the shape functions, shape (c, k, k), unit length^d."""

    def volumes(self, mesh: Cells) -> NDArray[Any]:
        """``int v`` of the shape functions, shape (c, k), unit length^d."""
        return np.asarray(self.mass(mesh).sum(axis=2))


@dataclass(frozen=True)
class P1(Element):
    """Hat functions on simplices: their gradients are constant on a cell."""

    words: str
    vtk: str
    supports = frozenset({"waves", "proofs", "values"})

    def locks(self, mesh: Mesh) -> bool:
        return not crossed(mesh)

    def points(self, mesh: Cells) -> Sequence[tuple[NDArray[Any], NDArray[Any]]]:
        return [(measures(mesh.points, mesh.cells), gradients(mesh))]

    def mass(self, mesh: Cells) -> NDArray[Any]:
        d, size = mesh.dimension, measures(mesh.points, mesh.cells)
        pattern = np.ones((d + 1, d + 1), dtype=int) + np.eye(d + 1, dtype=int)
        return np.asarray(size[:, None, None] * pattern / ((d + 1) * (d + 2)))

    def volumes(self, mesh: Cells) -> NDArray[Any]:
        d, size = mesh.dimension, measures(mesh.points, mesh.cells)
        return np.repeat(size[:, None] / (d + 1), d + 1, axis=1)


#: The element of a cell, by dimension and number of nodes.
ELEMENTS: dict[tuple[int, int], Element] = {(1, 2): P1("intervals", "line"), (2, 3): P1("triangles", "triangle")}

#: What an element may lack, in words.
ABILITIES = {
    "waves": "waves on layers",
    "proofs": "proofs",
    "values": "values inside the cells",
    "vtk": "files for ParaView",
}


def element_of(mesh: Cells) -> Element:
    """The element of the cells of a mesh; MeshError if there is none for so many nodes."""
    nodes = mesh.cells.shape[1]
    if (mesh.dimension, nodes) not in ELEMENTS:
        known = " or ".join(str(k) for d, k in ELEMENTS if d == mesh.dimension)
        raise MeshError(f"cells of {nodes} nodes: there are elements of {known}")
    return ELEMENTS[mesh.dimension, nodes]


def lacks(mesh: Cells, ability: str) -> str:
    """Why something cannot be done with the cells of a mesh; empty where their element supports it."""
    element = element_of(mesh)
    has = element.vtk if ability == "vtk" else ability in element.supports
    return "" if has else f"no {ABILITIES[ability]} with {element.words}"


def as_drawn(mesh: Mesh, values: Floats) -> tuple[Ints, list[tuple[str, Ints, Floats]]]:
    """The nodes and cells of a mesh before quadrilaterals were split by both diagonals, for files of meshio.

    Returns the nodes that are left, and for each kind of cell its name, the places of its corners among these nodes,
    and the means of values on the cells, shape (c, ..), weighted by their sizes.
    """
    around, corners = mesh.quadrilaterals
    kept = np.delete(np.arange(len(mesh.points)), mesh.centres)
    number = np.full(len(mesh.points), -1)
    number[kept] = np.arange(len(kept))
    whole = np.delete(np.arange(len(mesh.cells)), around)
    sizes = measures(mesh.points, mesh.cells)[around].reshape(*around.shape, *[1] * (values.ndim - 1))
    means = (sizes * values[around]).sum(axis=1) / sizes.sum(axis=1)
    blocks = [(element_of(mesh).vtk, number[mesh.cells[whole]], values[whole]), ("quad", number[corners], means)]
    return kept, [block for block in blocks if len(block[1])]


def gradients(mesh: Cells) -> NDArray[Any]:
    """Gradients of the hat functions, shape (c, d + 1, d), unit 1/length."""
    p = mesh.points[mesh.cells]
    size = measures(mesh.points, mesh.cells)
    if mesh.dimension == 1:
        return np.stack([-1 / size, 1 / size], axis=-1)[..., None]
    following, previous = np.roll(p, -1, axis=1), np.roll(p, 1, axis=1)
    opposite = following - previous  # the edge facing each vertex, reversed
    rotated = np.stack([opposite[..., 1], -opposite[..., 0]], axis=-1)
    return np.asarray(rotated / (2 * size)[:, None, None])


def stiffness(mesh: Cells, material: Material) -> NDArray[Any]:
    """``int lame_lambda div u div v + 2 lame_mu eps(u) : eps(v)``, shape (c, k, d, k, d).

    Unit: stress x length^(d - 2).  Entry (c, i, p, j, q) belongs to component p at node i and q at node j.
    """
    first, *others = (_stiffness(size, g, material) for size, g in element_of(mesh).points(mesh))
    return np.asarray(sum(others, start=first))


def _stiffness(size: NDArray[Any], g: NDArray[Any], material: Material) -> NDArray[Any]:
    outer = np.einsum("cip,cjq->cipjq", g, g)
    dot = np.einsum("cip,cjp->cij", g, g)
    unit = np.eye(g.shape[2], dtype=int)
    shear = np.einsum("cij,pq->cipjq", dot, unit) + outer.transpose(0, 1, 4, 3, 2)
    first, second = (np.reshape(value, (-1, 1, 1, 1, 1)) for value in (material.lame_lambda, material.lame_mu))
    return np.asarray((first * outer + second * shear) * size[:, None, None, None, None])


def laplace(mesh: Cells) -> NDArray[Any]:
    """``int grad u . grad v`` of scalar functions, shape (c, k, k), unit length^(d - 2)."""
    points = element_of(mesh).points(mesh)
    first, *others = (np.einsum("cip,cjp->cij", g, g) * size[:, None, None] for size, g in points)
    return np.asarray(sum(others, start=first))


def mass(mesh: Cells) -> NDArray[Any]:
    """``int u v`` of scalar functions, shape (c, k, k), unit length^d."""
    return element_of(mesh).mass(mesh)


def largest_strains(mesh: Cells, displacement: Floats, material: Material | None = None) -> Floats:
    """Largest absolute principal strain of each cell, shape (c,), a pure number.

    In the plane the principal strains of ``eps = (grad u + grad u') / 2``, u the displacement of the nodes, shape
    (n, d), unit of length, are ``(eps_xx + eps_yy)/2 +- sqrt((eps_xx - eps_yy)^2/4 + eps_xy^2)``; the third one is 0,
    and ``-(eps_xx + eps_yy) lame_lambda/(2 lame_mu)`` in plane stress, for which the material is needed.

    Examples
    --------
    >>> from fem1d2d import rectangle
    >>> mesh = rectangle((0.0, 1.0), (0.0, 1.0), (1, 1))
    >>> float(largest_strains(mesh, mesh.points * [0.25, -0.5]).max())
    0.5
    """
    found = []
    for _, slopes in _slopes(mesh, displacement):
        plane = np.zeros((2, 2, len(slopes)))
        plane[: mesh.dimension, : mesh.dimension] = np.moveaxis(slopes, 0, -1)
        (xx, xy), (yx, yy) = plane
        found.append(np.abs(xx + yy) / 2 + np.hypot((xx - yy) / 2, (xy + yx) / 2))
        if material is not None and material.thin:
            found.append(np.abs((xx + yy) * material.lame_lambda / (2 * material.lame_mu)))
    return np.asarray(np.max(found, axis=0))


def stresses(mesh: Cells, material: Material, displacement: Floats) -> Floats:
    """Mean stress tensor of each cell, shape (c, 3, 3), in the unit of the material.

    ``lame_lambda tr(eps) I + 2 lame_mu eps`` of the displacement of the nodes, shape (n, d): in plane strain with
    ``sigma_zz = lame_lambda tr(eps)``, in plane stress without it; a bar has only ``sigma_xx``.

    Examples
    --------
    >>> from fem1d2d import plane_strain, rectangle
    >>> mesh = rectangle((0.0, 1.0), (0.0, 1.0), (1, 1))
    >>> stresses(mesh, plane_strain(2.5, 0.25), mesh.points * [0.0, 0.5])[0].diagonal()
    array([0.5, 1.5, 0.5])
    """
    d, whole = mesh.dimension, measures(mesh.points, mesh.cells)
    strain = np.zeros((len(mesh.cells), 3, 3))
    for size, slopes in _slopes(mesh, displacement):
        strain[:, :d, :d] += (size / whole)[:, None, None] * (slopes + slopes.transpose(0, 2, 1)) / 2
    trace = np.trace(strain, axis1=1, axis2=2)[:, None, None]
    held = np.diag([1.0, float(d == 2), float(d == 2 and not material.thin)])
    first, second = (np.reshape(value, (-1, 1, 1)) for value in (material.lame_lambda, material.lame_mu))
    return np.asarray(first * trace * held + 2 * second * strain)


def von_mises(stress: Floats) -> Floats:
    """Equivalent stress ``sqrt(3/2 s : s)`` of tensors, shape (c, 3, 3), with s the part of trace zero.

    Examples
    --------
    >>> float(von_mises(np.diag([3.0, 0.0, 0.0])[None])[0])
    3.0
    """
    mean = np.trace(stress, axis1=1, axis2=2)[:, None, None] / 3
    return np.asarray(np.sqrt(1.5 * ((stress - mean * np.eye(3)) ** 2).sum(axis=(1, 2))))


def _slopes(mesh: Cells, displacement: Floats) -> Iterator[tuple[Floats, Floats]]:
    """The measure of each quadrature point, (c,), and the gradient of a displacement there, shape (c, d, d)."""
    for size, gradients in element_of(mesh).points(mesh):
        yield size, np.einsum("cip,ciq->cpq", gradients, displacement[mesh.cells])
