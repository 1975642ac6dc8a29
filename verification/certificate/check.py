"""Check a certificate of contraction: ``python check.py FILE``.  It needs Python and python-flint, nothing else.

Two elastic bodies meet along Gamma_c with Coulomb friction of coefficient k.  One step of the Neumann-Dirichlet
iteration takes a force psi to ``T_theta psi = theta T psi + (1 - theta) psi``: the Neumann body deforms under psi, and
T psi is the reaction of the contact body, which is pressed against it.  A certificate describes the discrete bodies in
rational numbers and claims that for all forces psi, psi~, whatever the loads, prescribed displacements and gaps::

    |T_theta psi - T_theta psi~| <= factor |psi - psi~|,    |g|^2 = g' S_n^-1 g   or   |g|^2 = g' Q g,

where the claim has a norm Q.  S_n and S_c are the stiffnesses of the Neumann and the contact body, as the contact nodes
see them.  ``check`` is the outline of the proof, and each function says one step of it.  Numbers of the file are
rational; those computed are balls of Arb, which hold the exact results, so that what holds of balls is proved.

Whether bodies, normals, transfer and a kernel without a radius belong to a certain problem is not decided here.
"""

import hashlib
import json
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from itertools import accumulate, pairwise, product
from typing import Any, NamedTuple

from flint import arb, arb_mat, ctx, fmpq

#: What a certificate that is none, or proves nothing, raises.
UNREADABLE = (OSError, ArithmeticError, AttributeError, LookupError, TypeError, ValueError, RecursionError, MemoryError)

BLOCK = 32  # unknowns eliminated at once
ALONG_AXES = ((1, 0), (0, 1))  # tangent and normal where the body lists none

Json = Any  # a part of the file
Vector = Sequence[Any]  # in the plane; or the coefficients of a linear form
Unknown = tuple[int, int]  # a node and a component: 0 and 1 are x and y, at a contact node tangent and normal
Rows = dict[Unknown, dict[Unknown, Any]]  # of a sparse matrix
Product = tuple[fmpq, Vector, Vector]  # a multiplier and the two linear forms whose product it multiplies
Cases = tuple[tuple[str, int, int, Any], ...]  # kind of division, contact node, 1 or -1, and the sign of the node


class Refused(ValueError):
    """The claim is not proved by its certificate."""


def check(discrete: Json, claim: Json, eliminated: Callable[..., arb_mat] | None = None) -> None:
    """Raise Refused, KeyError or another ValueError unless the multipliers of a claim prove it.

    T_theta is piecewise affine, and a Lipschitz constant of all its pieces is one of T_theta.  ``leaves`` divides the
    pieces into sets.  In each the multipliers give a sum of products that is >= 0 for any two steps (``inequalities``,
    ``equations``).  If ``factor^2 |g|^2 - |T_theta psi - T_theta psi~|^2`` (``margin``) always exceeds that sum, it is
    not negative, as claimed.  How the multipliers were found does not matter.  (``eliminated`` may stand in for
    surface_stiffness where several claims are checked.)
    """
    ctx.prec = min(int(claim["bits"]), 20000)
    theta, factor, k = map(rational, (claim["theta"], claim["factor"], discrete["friction"]))
    demand(0 < theta <= 1 and factor >= 0 and k >= 0, "0 < theta <= 1, a factor and a friction that are not negative")
    steps = two_steps(discrete, k, eliminated or surface_stiffness)
    contact_positions(discrete)  # which demands the weights of the trapezoid rule
    demand("radius" not in claim or kernel_is_hat(discrete, claim["radius"]), "as kernel the hat of the radius claimed")
    claimed = margin(steps, theta, factor, norm(steps, claim.get("norm")))
    for leaf, cases in leaves(claim["multipliers"]):
        products = [*inequalities(steps, leaf), *equations(steps, leaf, cases)]
        left = arb_mat([form for _, form, _ in products])
        total = left.transpose() * arb_mat([[value * x for x in form] for value, _, form in products])
        exceeds = positive_definite(claimed - (total + total.transpose()) / 2)
        demand(exceeds, "multipliers that prove it in balls of these bits")


def surface_stiffness(body: Json, both: bool) -> arb_mat:
    """The Schur complement of a body's stiffness on its contact nodes: tangential components, then normal ones.

    It is the least energy of displacements that are given there; without ``both`` only in the normal components.  All
    other unknowns are eliminated from left to right; a block that may be singular, within its balls, ends the check.
    """
    rows, order = stiffness(body)
    keep = [(node, p) for p in ((0, 1) if both else (1,)) for node in body["surface"]]
    kept, answers = set(keep), Rows()
    demand(len(kept) == len(keep) and kept <= set(rows), "contact nodes that are free, each once")
    inside = [unknown for unknown in order if unknown not in kept]
    for start in range(0, len(inside), BLOCK):
        block, ahead = inside[start : start + BLOCK], set(inside[start + BLOCK :])
        near = {j for i in block for j in rows[i]}
        front, beside = sorted(near & ahead), [*sorted(near & ahead), *sorted(near & kept)]
        # for so few unknowns radii grow less from block to block by this method than by default
        solved = entries(rows, block, block).solve(entries(rows, block, beside), algorithm="lu")
        answers.update((i, dict(zip(beside, row, strict=True))) for i, row in zip(block, solved.tolist(), strict=True))
        left = entries(rows, front, beside) - entries(rows, block, front).transpose() * solved
        for i, row in zip(front, left.tolist(), strict=True):
            rows[i].update(zip(beside, row, strict=True))
    return entries(rows, keep, keep) - entries(rows, inside, keep).transpose() * entries(answers, inside, keep)


def stiffness(body: Json) -> tuple[Rows, list[Unknown]]:
    """The stiffness matrix of all unknowns that no support holds, in rationals, and these from left to right.

    Twice the energy of u is the integral of ``lambda (div u)^2 + 2 mu e(u) : e(u)``.  It is not negative, as E > 0 and
    -1 < nu < 1/2, and that of one body, as its triangles do not overlap: listed twice they would be twice as stiff.
    """
    points = [[rational(x) for x in point] for point in body["points"]]
    young, nu = rational(body["young"]), rational(body["poisson"])
    demand(young > 0 and -1 < nu < fmpq(1, 2), "E > 0 and -1 < nu < 1/2")
    lame_lambda, lame_mu = young * nu / ((1 - 2 * nu) * (1 + nu)), young / (2 * (1 + nu))
    held = {(node, p) for node, p in body["held"]}
    named = {i for cell in body["cells"] for i in cell} | set(body["surface"]) | {node for node, _ in held}
    demand(all(type(i) is int and 0 <= i < len(points) for i in named), "node numbers")
    axes = dict(zip(body["surface"], zip(*tangents_and_normals(body), strict=True), strict=True))
    turned = any(axes.get(node, ALONG_AXES) != ALONG_AXES for node, _ in held)
    demand(not turned, "no support of a contact node with its own normal")
    rows, triangles = Rows(), [[points[i] for i in cell] for cell in body["cells"]]
    for cell, (a, b, c) in zip(body["cells"], triangles, strict=True):
        area, strains = twice_area(a, b, c) / 2, {}
        demand(area > 0, f"cell {cell} anticlockwise, of positive area")
        for i, (x0, y0), (x1, y1) in zip(cell, (b, c, a), (c, a, b), strict=True):
            gx, gy = (y0 - y1) / (2 * area), (x1 - x0) / (2 * area)  # the gradient of the function that is 1 at node i
            for p, (ux, uy) in enumerate(axes.get(i, ALONG_AXES)):
                strains[i, p] = ux * gx, uy * gy, ux * gy + uy * gx
        free = [(unknown, strain) for unknown, strain in strains.items() if unknown not in held]
        for (one, (xx, yy, xy)), (other, (vv, ww, vw)) in product(free, repeat=2):
            density = lame_lambda * (xx + yy) * (vv + ww) + lame_mu * (2 * xx * vv + 2 * yy * ww + xy * vw)
            rows.setdefault(one, {}).setdefault(other, fmpq(0))
            rows[one][other] += area * density
    demand_disjoint(triangles)
    return rows, sorted(rows, key=lambda unknown: (points[unknown[0]], unknown))


def demand_disjoint(triangles: list[Any]) -> None:
    """Demand that no two triangles overlap: of two that do not, one has a side with the other one beyond it."""
    boxes = ([(min(values), max(values)) for values in zip(*triangle, strict=True)] for triangle in triangles)
    near: list[Any] = []  # those before, from left to right, that reach as far as the next one begins
    for ((left, right), (low, high)), triangle in sorted(zip(boxes, triangles, strict=True)):
        near = [other for other in near if other[0] > left]
        for _, bottom, top, other in near:
            apart = bottom >= high or top <= low or beyond(triangle, other) or beyond(other, triangle)
            demand(apart, "cells that do not overlap, each listed once")
        near.append((right, low, high, triangle))


def beyond(triangle: list[Vector], other: list[Vector]) -> bool:
    """True if a side of a triangle has the other one beyond it."""
    return any(all(twice_area(triangle[i - 1], triangle[i], at) <= 0 for at in other) for i in range(3))


def twice_area(a: Vector, b: Vector, c: Vector) -> Any:
    return (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])


def tangents_and_normals(body: Json) -> tuple[list[Vector], list[Vector]]:
    """Tangents and normals at the contact nodes; along x and y where the body lists none."""
    normals = [(rational(x), rational(y)) for x, y in body.get("normals") or [["0", "1"]] * len(body["surface"])]
    demand(len(normals) == len(body["surface"]) and all(x * x + y * y == 1 for x, y in normals), "normals of length 1")
    return [(y, -x) for x, y in normals], [*normals]


def neumann_and_contact(discrete: Json) -> list[Json]:
    """The body that takes forces, and the body that is pressed against it."""
    demand(discrete["neumann_body"] in (1, 2), "neumann_body 1 or 2")
    return [discrete[f"body{i}"] for i in ((2, 1) if discrete["neumann_body"] == 2 else (1, 2))]


def contact_positions(discrete: Json) -> tuple[list[arb], list[arb]]:
    """Positions of the contact nodes and the Neumann nodes, along x or along their lines: as the weights have it.

    The nodes must follow each other along the boundary.  The weights must belong to the trapezoid rule for one of these
    positions, which increase, and a kernel with a radius must be its hat.  Positions may be rounded: both are compared
    up to 1e-6, and the proof uses the numbers that are listed.
    """
    weights, both = [rational(w) for w in discrete["weights"]], []
    for body in neumann_and_contact(discrete):
        edges = {(cell[i - 1], cell[i]) for cell in body["cells"] for i in range(3)}
        follow = all(((a, b) in edges) != ((b, a) in edges) for a, b in pairwise(body["surface"]))
        demand(follow, "contact nodes that follow each other along the boundary")
        nodes = [[arb(rational(x)) for x in body["points"][i]] for i in body["surface"]]
        lengths = (((a - x) ** 2 + (b - y) ** 2).sqrt() for (a, b), (x, y) in pairwise(nodes))
        both.append(([x for x, _ in nodes], [*accumulate(lengths, initial=arb(0))]))
    for other, own in zip(*both, strict=True):
        ends = [own[0], *own, own[-1]]
        halves = [(after - before) / 2 for before, after in zip(ends, ends[2:], strict=False)]
        increase = len(own) == len(weights) and all(a < b for a, b in pairwise(own))
        if increase and all(map(close, weights, halves, halves)):
            return own, (other if discrete["transfer"] else own)
    raise Refused("needed the trapezoid weights of the contact nodes")


def kernel_is_hat(discrete: Json, radius: Json) -> bool:
    """True if the kernel is the hat of a radius, ``max(0, 1 - |x - y|/r)/r``."""
    r, (own, other) = arb(rational(radius)), contact_positions(discrete)
    listed = rational_matrix(discrete["kernel"], len(own), len(other)).entries()
    hat = [arb(0).max(1 - abs(x - y) / r) / r for x in own for y in other]
    return all(close(one, value, 1 / r) for one, value in zip(listed, hat, strict=True))


class TwoSteps(NamedTuple):
    """Differences of two steps, as linear forms in (d, c): a row for each component, tangential ones first."""

    S_n: arb_mat
    g: arb_mat  # of the forces
    reaction: arb_mat  # P' p
    p: list[Any]
    v: list[Any]
    zeta: list[Any]
    rubs: list[fmpq]  # w k


def two_steps(discrete: Json, k: fmpq, eliminated: Callable[..., arb_mat]) -> TwoSteps:
    """Let the forces on the Neumann body differ by ``g = S_n d``, so that its displacements differ by d.

    Let the contact body's displacements differ by -c.  Its reactions differ by ``p = S_c c``, the jumps by
    ``v = -(P d + c)``, P being the transfer between both grids, and the friction bounds by at most ``w k |zeta|``,
    ``zeta = kernel g_N``.  Without friction ``p_T = 0``, and c has only normal components.
    """
    neumann, contact = bodies = neumann_and_contact(discrete)
    n, m = len(contact["surface"]), len(neumann["surface"])
    S_n, S_c = eliminated(neumann, both=True), eliminated(contact, both=k != 0)
    grids = rational_matrix(discrete["transfer"], n, m) if discrete["transfer"] else arb_mat(n, n, 1)
    demand(grids.ncols() == m, "a transfer between contact nodes that differ")
    of, onto = ([*enumerate(tangents), *enumerate(normals)] for tangents, normals in map(tangents_and_normals, bodies))
    onto = onto if k != 0 else onto[n:]
    P = arb_mat([[grids[i, j] * (ux * wx + uy * wy) for j, (wx, wy) in of] for i, (ux, uy) in onto])
    unknowns = arb_mat(len(of) + len(onto), len(of) + len(onto), 1).tolist()
    d, c = arb_mat(unknowns[: len(of)]), arb_mat(unknowns[len(of) :])
    g, p, v = S_n * d, S_c * c, -(P * d + c)
    zeta = rational_matrix(discrete["kernel"], n, m) * arb_mat(g.tolist()[m:]) if k != 0 else arb_mat(0, 0)
    rubs = [k * rational(w) for w in discrete["weights"] if k != 0]
    return TwoSteps(S_n, g, P.transpose() * p, p.tolist(), v.tolist(), zeta.tolist(), rubs)


def norm(steps: TwoSteps, given: Json) -> arb_mat | None:
    """The Q of a norm, whose lower triangle is listed: ``g' S_n^-1 g < g' Q g < condition g' S_n^-1 g``."""
    if given is None:
        return None
    lower, condition, size = given["matrix"], rational(given["condition"]), steps.S_n.nrows()
    demand([len(row) for row in lower] == [*range(1, size + 1)], f"a lower triangle of {size} rows")
    Q = arb_mat([[rational(lower[max(i, j)][min(i, j)]) for j in range(size)] for i in range(size)])
    energy = steps.S_n * Q * steps.S_n
    between = positive_definite(energy - steps.S_n) and positive_definite(condition * steps.S_n - energy)
    demand(between, "a norm between (5.21) and its condition times (5.21)")
    return Q


def margin(steps: TwoSteps, theta: fmpq, factor: fmpq, Q: arb_mat | None) -> arb_mat:
    """``factor^2 |g|^2 - |theta P' p + (1 - theta) g|^2`` as a matrix in (d, c)."""
    g, after = steps.g, theta * steps.reaction + (1 - theta) * steps.g
    weighed = [steps.S_n.solve(force) if Q is None else Q * force for force in (g, after)]
    return factor**2 * g.transpose() * weighed[0] - after.transpose() * weighed[1]


def inequalities(steps: TwoSteps, leaf: Json) -> Iterator[Product]:
    """Products whose sum is >= 0: ``lambda p_N v_N + tau p_T v_T + w k (a zeta^2 + b v_T^2)`` at each node.

    Pressure is a monotone function of the jump: ``p_N v_N >= 0``.  So is friction up to its bound: ``p_T v_T >= -w k
    |zeta| |v_T|``.  And ``tau |zeta| |v_T| <= a zeta^2 + b v_T^2``, as ``4 a b >= tau^2``.
    """
    t, n = len(steps.rubs), len(steps.v) - len(steps.rubs)
    given = (leaf[name] for name in ("lambda", "tau", "a", "b"))  # one for each node, or one for all of them
    lam, tau, a, b = ([rational(x) for x in (one if isinstance(one, list) else [one] * n)] for one in given)
    demand(all(len(each) == n for each in (lam, tau, a, b)), f"{n} multipliers of each kind")
    demand(all(x >= 0 for x in lam + tau + a + b), "multipliers that are not negative")
    demand(all(4 * x * y >= z * z for x, y, z in zip(a, b, tau, strict=True)), "4 a b >= tau^2")
    yield from zip(tau[:t] + lam, steps.p, steps.v, strict=True)
    yield from ((w * x, zeta, zeta) for w, x, zeta in zip(steps.rubs, a[:t], steps.zeta, strict=True))
    yield from ((w * x, slip, slip) for w, x, slip in zip(steps.rubs, b[:t], steps.v[:t], strict=True))


def equations(steps: TwoSteps, leaf: Json, cases: Cases) -> Iterator[Product]:
    """Products that are 0 on the pieces of some cases, one for each, so that its multiplier may have any sign.

    A node touches, ``v_N = 0`` (normal, 1), or is open, ``p_N = 0`` (-1).  For one e, 1 or -1 (signs), ``(p_T - e w k
    zeta) v_T = 0``: the node slides, and the first factor is 0 (slip, 1), or it sticks, and the second one is (-1).
    """
    t, values = len(steps.rubs), [rational(x) for x in leaf.get("equal", [])]
    demand(len(values) == len(cases), "one more multiplier for each case")
    for value, (kind, j, case, sign) in zip(values, cases, strict=True):
        demand(j in range(len(steps.v) - t if kind == "normal" else t), "a contact node")
        if kind == "normal":
            left = right = steps.v[t + j] if case > 0 else steps.p[t + j]
        elif kind == "slip" and case < 0:
            left = right = steps.v[j]
        else:
            left = [x - sign * steps.rubs[j] * y for x, y in zip(steps.p[j], steps.zeta[j], strict=True)]
            right = steps.v[j] if kind == "signs" else left
        yield value, left, right


def leaves(tree: Json, cases: Cases = ()) -> Iterator[tuple[Json, Cases]]:
    """The leaves of a tree, each with its cases.  A division has both cases of a node, so that no piece is left out."""
    if "cases" not in tree:
        yield tree, cases
        return
    kind, j, branches = tree["divided"], tree["node"], tree["cases"]
    signs = {node: case for divided, node, case, _ in cases if divided == "signs"}
    demand(len(branches) == 2, "both cases of each division")
    demand(kind in ("normal", "signs") or (kind == "slip" and j in signs), "normal, signs, or then slip")
    for branch, case in zip(branches, (1, -1), strict=True):
        yield from leaves(branch, (*cases, (kind, j, case, case if kind == "signs" else signs.get(j))))


def positive_definite(form: arb_mat) -> bool:
    """True if all symmetric matrices in these balls are positive definite: their half and its Schur complement are."""
    half, rows = form.nrows() // 2, form.tolist()
    if not half:
        return bool(form[0, 0] > 0)
    A, B = (arb_mat([row[part] for row in rows[:half]]) for part in (slice(half), slice(half, None)))
    C = arb_mat([row[half:] for row in rows[half:]])
    return positive_definite(A) and positive_definite(C - B.transpose() * A.solve(B))


def close(one: Any, other: Any, size: Any) -> bool:
    return bool(abs(one - other) < size / 10**6)


def demand(holds: bool, needed: str) -> None:
    if not holds:
        raise Refused(f"needed {needed}")


def rational(text: Json) -> fmpq:
    readable = isinstance(text, str) and re.fullmatch(r"-?\d{1,2000}(/\d{1,2000})?", text)
    demand(bool(readable), f"a rational, not {text!r}")
    return fmpq(*(int(part) for part in text.split("/")))


def rational_matrix(rows: Json, n: int, m: int) -> arb_mat:
    demand(len(rows) == n and all(len(row) == m for row in rows), f"a matrix of {n} x {m}")
    return arb_mat([[rational(x) for x in row] for row in rows])


def entries(rows: Rows, wanted: list[Unknown], columns: list[Unknown]) -> arb_mat:
    return arb_mat(len(wanted), len(columns), [rows[i].get(j, 0) for i in wanted for j in columns])


def digest(data: Json) -> str:
    """A hash of the bodies and all else that the claim is about."""
    return hashlib.sha256(json.dumps(data, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def words(document: Json) -> str:
    """The claim and its bodies, for a reader."""
    discrete, claim = document["discrete"], document["claim"]
    friction, name = "no friction", "(5.21)"
    if rational(discrete["friction"]) != 0:
        kernel = f"hat kernel of radius {claim['radius']}" if "radius" in claim else "kernel that it lists"
        friction = f"k {discrete['friction']} with the {kernel}"
    if "norm" in claim:
        condition = float(arb(rational(claim["norm"]["condition"])).mid())
        name = f"Q of the certificate, of condition {condition:.6g} in (5.21)"
    said = [
        f"{name}: {len(body['points'])} nodes, {len(body['cells'])} triangles, E {body['young']}, nu {body['poisson']}"
        for name, body in (("body1", discrete["body1"]), ("body2", discrete["body2"]))
    ]
    said.append(f"Neumann problem: body {discrete['neumann_body']}, {friction}, theta {claim['theta']}")
    spare = float(arb(1 - rational(claim["factor"])).mid())
    return "; ".join([*said, f"Lipschitz constant at most 1 - {spare:.10g} in the norm {name}"])


def examine(document: Json) -> None:
    """Raise one of UNREADABLE unless a certificate proves its claim."""
    demand(document["sha256"] == digest(document["discrete"]), "the hash of its bodies")
    check(document["discrete"], document["claim"])


def main(path: str) -> int:
    try:
        with open(path, encoding="utf-8") as file:
            document = json.load(file)
        show(words(document))
        print("sha256 of the bodies and what joins them:", digest(document["discrete"]))
        examine(document)
    except UNREADABLE as error:
        show(f"REFUSED: {type(error).__name__}: {error}")
        return 1
    print("ACCEPTED:", "T_theta contracts" if rational(document["claim"]["factor"]) < 1 else "no contraction claimed")
    return 0


def show(text: str) -> None:
    print(repr(text)[1:-1])  # it may come from the certificate: nothing in it steers a terminal


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]) if len(sys.argv) == 2 else "needed: python check.py certificate.json")
