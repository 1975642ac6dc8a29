"""Stresses and motions along Gamma_c, node by node, in the frame of the paper."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from fem1d2d.mesh import Floats, Ints
from fem1d2d.trace import SAME
from ndtheory.keys import ABSENT, Key, Part, document, key, says
from verification.contact.active_set import Pattern
from verification.interface.interface import Interface, Stretch
from verification.value import Value, copied, lent

STATES = ("stick", "slip", "open")

#: What a static solution does to friction at nodes that come into contact on the way.
GROWN = (
    "that were apart touch with friction: slip counts from the drawn state, before they touched, so that their shear is"
    " not the one of a load that grows; `ndtheory march` with [[step]] tables follows it"
)

#: Keys of the total forces of all contacts, and of each of several.
OF_FORCE = Key(
    says="totals, the tangential one on body 2; of several contacts the sums of `forces`, which act on no single body",
    unit="stress · length",
    type="number",
)
OF_FORCES = {
    "bodies": Key(says="numbers of its bodies", type="list of integer"),
    **dict.fromkeys(
        ("normal", "tangential"), replace(OF_FORCE, says="totals, the tangential one on the second of them")
    ),
    "vector": Key(
        says="the total force on the second of them along x and y", unit="stress · length", type="list of number"
    ),
}


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ContactFields(Value, Part):
    """Stresses and motions along Gamma_c, in the direction of s: arrays of n contact nodes.

    In 1D ``weights`` are 1, and shear, bound and slip are 0.  In a run the friction bound belongs to the g before step
    II.  ``slip_increment`` is all of the slip unless the interface has slipped before.  A node that touches and whose
    friction bound is zero slips.  ``lines`` are those of more than two bodies, one after the other, empty for two
    bodies; of each, ``s`` begins at 0.
    """

    part: ClassVar[str] = "Fields"

    x: Floats = key("before deformation", name="contact.x", unit="length")
    y: Floats | None = key(
        "before deformation, on the contact body",
        name="contact.y",
        unit="length",
        null="in 1D and of a pair made from matrices",
        why=None,
        default=None,
    )
    s: Floats = key(
        r"distance along $\Gamma_c$ from its first node, on the contact body", name="contact.s", unit="length"
    )
    normal: Floats | None = key(
        "unit normals from body 1 to body 2",
        name="contact.normal",
        type="list of list of number",
        null="in 1D",
        why=None,
        default=None,
    )
    weights: Floats
    pressure: Floats = key(r"$-\sigma_N \ge 0$", name="contact.pressure", unit="stress")
    shear: Floats = key("tangential stress on body 2", name="contact.shear", unit="stress")
    bound: Floats = key(
        r"friction bound $k_j\lvert S\sigma_N\rvert$, of a run with the forces that step II was given; 0 in 1D",
        name="contact.bound",
        unit="stress",
    )
    gap: Floats = key("distance of the bodies", name="contact.gap", unit="length")
    slip: Floats = key("$u^1_T - u^2_T$, since the drawn state", name="contact.slip", unit="length")
    slip_increment: Floats
    status: tuple[str, ...] = key("`stick`, `slip` or `open`; `contact.status` in Python", name="contact.state")
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
            s=np.concatenate([grid.x[line.contact] - grid.x[line.contact.start] for line in interface.lines]),
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
            lines=interface.lines if interface.several else (),
        )

    def in_order(self) -> ContactFields:
        """Return the same fields with each of several lines as the file has it: the first of its bodies is body 1."""
        turned = [line.contact for line in self.lines if line.flipped]
        if not turned:
            return self
        order = np.arange(len(self.x))
        for nodes in turned:
            order[nodes] = order[nodes][::-1]
        found = self._at(order)
        for nodes in turned:  # s from the other end
            found["s"][nodes] = self.s[nodes][-1] - found["s"][nodes]
            found["normal"][nodes] = 0.0 - found["normal"][nodes]
        return copied(self, **found, lines=tuple(replace(line, flipped=False) for line in self.lines))

    def _at(self, nodes: Ints) -> dict[str, Any]:
        """The values at some nodes, by the names of the fields."""
        arrays = {name: value[nodes] for name, value in vars(self).items() if isinstance(value, np.ndarray)}
        return {**arrays, "status": tuple(self.status[i] for i in nodes)}

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
        return replace(own, **{**own._at(np.concatenate(order)), "x": np.concatenate(x)}, lines=())

    def between(self, low: float, high: float) -> ContactFields:
        """Return the part of Gamma_c from one position to another."""
        return replace(self, **self._at(np.flatnonzero((self.x >= low) & (self.x <= high))), lines=())

    @property
    @says(inside=dict.fromkeys(STATES, Key(says="number of nodes in each state", type="integer")))
    def pattern(self) -> dict[str, int]:
        """Number of nodes that stick, slip and are open."""
        return {name: self.status.count(name) for name in STATES}

    @property
    def apart(self) -> bool:
        """True if nothing touches."""
        return set(self.status) == {"open"}

    def grown(self, interface: Interface, k: float) -> list[str]:
        """Return a warning where nodes that were apart touch with friction: their shear depends on the way there."""
        apart = interface.gap > SAME * np.ptp(interface.contact.x)
        met = apart & (np.array(self.status) != "open")
        if not (k and met.any()) or interface.law is None or interface.slipped.any():
            return []
        return [f"{int(met.sum())} nodes {GROWN}"]

    def warnings(self, length: str) -> list[str]:
        """Return a warning where nothing touches, with the unit of length."""
        far = f"the bodies stay apart along Gamma_c, by at least {float(self.gap.min()):.3g} {length}"
        return [f"nothing touches: {far}"] if self.apart else []

    @lent
    @says(inside=dict.fromkeys(("normal", "tangential"), OF_FORCE))
    def force(self) -> dict[str, float]:
        """Total normal (compressive) and tangential (on body 2) force per unit thickness."""
        return {"normal": float(self.pressure @ self.weights), "tangential": float(self.shear @ self.weights)}

    @property
    @says(
        "the total force on body 2 along x and y, in 1D along x; the sum of `forces` where there are some",
        name="force.vector",
        unit="stress · length",
    )
    def vector(self) -> Floats:
        """Total force on body 2 along the axes."""
        return self.weights @ self.tractions

    @lent
    @says(
        "totals of each of several contacts",
        absent="of two bodies",
        inside=OF_FORCES,
        of=lambda forces: forces or ABSENT,
    )
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
        return lists | ({} if self.interface is None else {"interface": self.interface})

    @property
    @says(name="contact.interface", absent="of two bodies")
    def interface(self) -> list[int] | None:
        """The number of the contact in the file, from 0."""
        return [i for i, line in enumerate(self.lines) for _ in range(line.contact.start, line.contact.stop)] or None

    @property
    @says(name="contact.reason", absent="where none is")
    def missing(self) -> dict[str, str] | None:
        """Why a key of `contact` is null."""
        why = "bars meet at a point" if self.normal is None else "the pair is made from matrices, without meshes"
        return {name: why for name in ("y", "normal") if getattr(self, name) is None} or None

    def to_dict(self) -> dict[str, Any]:
        """The objects ``force``, ``pattern`` and ``contact`` of runs and solutions, lines as the file has them."""
        return document(self.in_order())
