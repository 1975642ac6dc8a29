"""Stresses and motions along Gamma_c, node by node, in the frame of the paper."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem1d2d.mesh import Floats
from verification.contact.active_set import Pattern
from verification.interface.interface import Interface
from verification.value import Value


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ContactFields(Value):
    """Stresses and motions along Gamma_c, in the direction of s.

    Attributes
    ----------
    x : array, shape (n,)
        Position before deformation along the x axis, unit of length.
    s : array, shape (n,)
        Distance along Gamma_c from its first node.
    y : array, shape (n,), or None
        Position along the y axis; None in 1D and where only matrices are known.
    normal : array, shape (n, 2), or None
        Unit normals from body 1 to body 2; None in 1D.
    weights : array, shape (n,)
        w_j, unit of length; 1 in 1D.
    pressure : array
        ``-sigma_N >= 0``: nodal force over w_j, unit of stress.
    shear : array
        Tangential force on body 2 over w_j, unit of stress; 0 in 1D.
    bound : array
        Friction bound ``k |S sigma_N|``, unit of stress; 0 in 1D.  In a run it belongs to the g before step II.
    gap : array
        Distance of the bodies, >= 0, unit of length.
    slip : array
        ``u1_T - u2_T``, unit of length; 0 in 1D.
    slip_increment : array
        The part of it that the load increment brought: all of it unless the interface has slipped before.
    status : tuple of {'stick', 'slip', 'open'}
        A node that touches and whose friction bound is zero slips.
    """

    x: Floats
    s: Floats
    weights: Floats
    pressure: Floats
    shear: Floats
    bound: Floats
    gap: Floats
    slip: Floats
    slip_increment: Floats
    status: tuple[str, ...]
    y: Floats | None = None
    normal: Floats | None = None

    @property
    def summary(self) -> str:
        return ", ".join(f"{count} {name}" for name, count in self.pattern.items())

    @classmethod
    def of(cls, interface: Interface, *, force: Floats, bound: Floats, jump: Floats, state: Pattern) -> ContactFields:
        """Make the fields from interface vectors on the contact grid, tangential components first.

        Parameters
        ----------
        force : array
            Nodal forces: tangential on body 2, normal compressive.
        bound : array, shape (t,)
            Friction bound on nodal forces.
        jump : array
            ``u1_T - u2_T`` less the slip so far, and ``[u_N] - gap <= 0``.
        state : Pattern
        """
        grid = interface.contact
        plane, zero = grid.t > 0, np.zeros(grid.n)
        slip = jump[grid.tangential] if plane else zero
        slides = state.sliding != 0 if plane else np.ones(grid.n, dtype=bool)
        names = np.where(state.touching, np.where(slides, "slip", "stick"), "open")
        return cls(
            x=grid.x if grid.points is None else grid.points[:, 0],
            s=grid.s,
            y=None if grid.points is None else grid.points[:, 1],
            normal=grid.upright if plane else None,
            weights=grid.weights,
            pressure=force[grid.normal] / grid.weights,
            shear=force[grid.tangential] / grid.weights if plane else zero,
            bound=bound / grid.weights if plane else zero,
            gap=-jump[grid.normal] + 0.0,
            slip=slip + interface.offset[grid.tangential] if plane else zero,
            slip_increment=slip.copy(),
            status=tuple(str(name) for name in names),
        )

    def between(self, low: float, high: float) -> ContactFields:
        """Return the part of Gamma_c from one position to another."""
        kept = np.flatnonzero((self.x >= low) & (self.x <= high))
        status = tuple(self.status[i] for i in kept)
        arrays = {name: value[kept] for name, value in vars(self).items() if isinstance(value, np.ndarray)}
        return replace(self, **arrays, status=status)

    @property
    def pattern(self) -> dict[str, int]:
        """Number of nodes that stick, slip and are open."""
        return {name: self.status.count(name) for name in ("stick", "slip", "open")}

    @property
    def force(self) -> dict[str, float]:
        """Total normal (compressive) and tangential (on body 2) force per unit thickness."""
        return {"normal": float(self.pressure @ self.weights), "tangential": float(self.shear @ self.weights)}

    @property
    def tractions(self) -> Floats:
        """Stresses on body 2 along the axes, shape (n, d): pressure along the normals, shear along the tangents."""
        if self.normal is None:
            return self.pressure[:, None]
        tangent = np.stack([self.normal[:, 1], -self.normal[:, 0]], axis=1)
        return np.asarray(self.pressure[:, None] * self.normal + self.shear[:, None] * tangent)

    def table(self) -> dict[str, list[Any]]:
        """Return Gamma_c as plain columns, one row a contact node: ``pandas.DataFrame(contact.table())`` reads it."""
        names = ("x", *(() if self.y is None else ("y",)), "s", "weights", "pressure", "shear", "bound", "gap", "slip")
        return {name: getattr(self, name).tolist() for name in names} | {"status": list(self.status)}

    def to_dict(self) -> dict[str, Any]:
        """Return the objects ``force``, ``pattern`` and ``contact`` that runs and solutions share."""
        names = ("x", "y", "s", "normal", "pressure", "shear", "bound", "gap", "slip")
        arrays = {name: getattr(self, name) for name in names}
        why = "bars meet at a point" if self.normal is None else "the pair is made from matrices, without meshes"
        missing = {name: why for name, values in arrays.items() if values is None}
        lists = {name: None if values is None else values.tolist() for name, values in arrays.items()}
        return {
            "force": {**self.force, "vector": (self.weights @ self.tractions).tolist()},
            "pattern": self.pattern,
            "contact": {**lists, "state": list(self.status), **({"reason": missing} if missing else {})},
        }
