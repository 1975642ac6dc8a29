"""Stresses and motions along Gamma_c, node by node, in the frame of the paper."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem1d2d.mesh import Floats, Ints
from verification.contact.active_set import Pattern
from verification.interface.interface import Interface, Stretch
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
    lines : tuple of Stretch
        The lines of more than two bodies, one after the other; empty for two bodies.  Of each, ``s`` begins at 0.
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
    lines: tuple[Stretch, ...] = ()

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
        slides = (state.sliding != 0) | (bound == 0) if plane else np.ones(grid.n, dtype=bool)
        names = np.where(state.touching, np.where(slides, "slip", "stick"), "open")
        return cls(
            x=grid.x if grid.points is None else grid.points[:, 0],
            s=np.concatenate([grid.x[line] - ends[0] for line, _, ends in interface.stretches]),
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
            lines=interface.lines,
        )

    def in_order(self) -> ContactFields:
        """Return the same fields with each of several lines as the file has it: the first of its bodies is body 1."""
        order, turned = np.arange(len(self.x)), np.zeros(len(self.x), dtype=bool)
        for line in self.lines:
            if line.flipped:
                order[line.contact], turned[line.contact] = order[line.contact][::-1], True
        if not turned.any():
            return self
        taken, s = self.at(order), self.s[order]
        for line in self.lines:  # s from the other end
            if line.flipped:
                s[line.contact] = self.s[line.contact][-1] - s[line.contact]
        normal = np.where(turned[:, None], -1.0, 1.0) * taken.normal + 0.0
        return replace(taken, s=s, normal=normal, lines=tuple(replace(line, flipped=False) for line in self.lines))

    def at(self, nodes: Ints) -> ContactFields:
        """Return the fields at some nodes."""
        arrays: dict[str, Any] = {name: v[nodes] for name, v in vars(self).items() if isinstance(v, np.ndarray)}
        return replace(self, **arrays, status=tuple(self.status[i] for i in nodes))

    def unrolled(self) -> ContactFields:
        """Return the fields with s in place of x; several lines follow each other, with NaN between them."""
        if not self.lines:
            return replace(self, x=self.s)
        own, shift = self.in_order(), 0.0
        order, x = [], []
        for line in own.lines:
            s = own.s[line.contact]
            x.append(np.append(s + shift, np.nan))
            order.append(np.append(np.arange(len(own.x))[line.contact], line.contact.stop - 1))
            shift += 1.05 * float(s[-1])  # a gap that is seen
        return replace(own.at(np.concatenate(order)), x=np.concatenate(x), lines=())

    def between(self, low: float, high: float) -> ContactFields:
        """Return the part of Gamma_c from one position to another."""
        return replace(self.at(np.flatnonzero((self.x >= low) & (self.x <= high))), lines=())

    @property
    def pattern(self) -> dict[str, int]:
        """Number of nodes that stick, slip and are open."""
        return {name: self.status.count(name) for name in ("stick", "slip", "open")}

    @property
    def apart(self) -> bool:
        """True if nothing touches."""
        return set(self.status) == {"open"}

    def warnings(self, length: str) -> list[str]:
        """Return a warning where nothing touches, with the unit of length."""
        far = f"the bodies stay apart along Gamma_c, by at least {float(self.gap.min()):.3g} {length}"
        return [f"nothing touches: {far}"] if self.apart else []

    @property
    def force(self) -> dict[str, float]:
        """Total normal (compressive) and tangential (on body 2) force per unit thickness."""
        return {"normal": float(self.pressure @ self.weights), "tangential": float(self.shear @ self.weights)}

    @property
    def forces(self) -> list[dict[str, Any]]:
        """Total force of each of several lines, with its bodies: ``vector`` acts on the second of them."""
        found = []
        for line in self.lines:
            w, sign = self.weights[line.contact], -1.0 if line.flipped else 1.0
            normal, tangential = (float(w @ stress[line.contact]) for stress in (self.pressure, self.shear))
            vector = (sign * (w @ self.tractions[line.contact])).tolist()
            found.append({"bodies": list(line.bodies), "normal": normal, "tangential": tangential, "vector": vector})
        return found

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
        own = self.in_order()
        lists = {name: getattr(own, name).tolist() for name in names} | {"status": list(own.status)}
        return lists | ({"interface": self._interface()} if self.lines else {})

    def _interface(self) -> list[int]:
        """Return the number of the line of each node, from 0."""
        return [i for i, line in enumerate(self.lines) for _ in range(line.contact.start, line.contact.stop)]

    def to_dict(self) -> dict[str, Any]:
        """Return the objects ``force``, ``pattern`` and ``contact`` that runs and solutions share."""
        names = ("x", "y", "s", "normal", "pressure", "shear", "bound", "gap", "slip")
        own = self.in_order()
        arrays = {name: getattr(own, name) for name in names}
        why = "bars meet at a point" if self.normal is None else "the pair is made from matrices, without meshes"
        missing = {name: why for name, values in arrays.items() if values is None}
        lists = {name: None if values is None else values.tolist() for name, values in arrays.items()}
        each = {"interface": self._interface()} if self.lines else {}
        return {
            "force": {**self.force, "vector": (own.weights @ own.tractions).tolist()},
            **({"forces": self.forces} if self.lines else {}),
            "pattern": self.pattern,
            "contact": {**lists, "state": list(own.status), **each, **({"reason": missing} if missing else {})},
        }
