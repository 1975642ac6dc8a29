"""Check a certificate of contraction; needs only the standard library and python-flint: ``python check.py FILE``.

A certificate describes two elastic bodies on meshes of triangles in rational numbers and claims that the map T_theta of
the Neumann-Dirichlet iteration between them has a Lipschitz constant, whatever the loads and the gap.  S_a are the
Schur complements of the stiffness matrices on the contact nodes, the form ``.' S_n^-1 .`` is the squared norm of forces
on the Neumann body, and P carries its traces to the contact nodes.  Two forces g = S_n d differ by p = S_c c after step
II, and the displacement of the contact body relative to the other one by v = -(P d + c).  Step II gives, node by node::

    p_N v_N >= 0,      p_T v_T >= -w k |zeta| |v_T|  with  zeta = kernel g_N,

so that for multipliers lambda, tau, a, b >= 0 with 4 a b >= tau^2 the sum over the nodes of
``lambda p_N v_N + tau p_T v_T + w k (a zeta^2 + b v_T^2)`` is not negative.  The claim holds if::

    factor^2 |g|^2 - |theta P' p + (1 - theta) g|^2 - that sum

is a positive definite form in (d, c).  Here it is enclosed in balls, from the rational data on, and decided.

T_theta is piecewise affine, and a constant of all its pieces is one.  On a piece each node has v_N = 0 (normal, 1) or
p_N = 0 (-1), and a sign e (signs, 1 or -1) with ``(p_T - e w k zeta) v_T = 0``; the first factor is 0 (slip, 1) or the
other one (-1).  A tree divides the pieces by such cases.  Each of its leaves has multipliers, and for each case on the
way to it one more, of any sign, for a form that vanishes there: a square, or the product.

Whether bodies, normals, transfer and a kernel without a radius belong to a certain problem is not decided here.
"""

import hashlib
import json
import re
import sys
from itertools import accumulate, pairwise

from flint import arb, arb_mat, ctx, fmpq

#: What a certificate that is none, or proves nothing, raises.
UNREADABLE = (OSError, ArithmeticError, AttributeError, LookupError, TypeError, ValueError, RecursionError, MemoryError)

#: Unknowns eliminated at once, and those whose effect on the contact nodes is added up at once.
BLOCK, BATCH = 32, 128


dot = lambda u, v: u[0] * v[0] + u[1] * v[1]
identity = lambda n: arb_mat([[int(i == j) for j in range(n)] for i in range(n)])
part = lambda whole, rows, columns: arb_mat([[whole[i, j] for j in columns] for i in rows])
gathered = lambda rows, at, columns: arb_mat(len(at), len(columns), [rows[i].get(j, 0) for i in at for j in columns])
scaled = lambda values, rows: arb_mat([[arb(f) * x for x in row] for f, row in zip(values, rows.tolist(), strict=True)])

#: A hash of the bodies and all else that the claim is about.
digest = lambda data: hashlib.sha256(json.dumps(data, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


class Refused(ValueError):
    """The claim is not proved by its certificate."""


def check(discrete, claim, eliminated=None):
    """Raise Refused, KeyError or another ValueError unless the multipliers of a claim prove it.

    ``eliminated`` may stand in for surface_stiffness where several claims are checked: it keeps what that returned.
    """
    stiffness = eliminated or surface_stiffness
    ctx.prec = min(int(claim["bits"]), 20000)
    theta, factor, k = map(rational, (claim["theta"], claim["factor"], discrete["friction"]))
    demand(0 < theta <= 1 and factor >= 0 and k >= 0, "0 < theta <= 1, a factor and a friction that are not negative")
    neumann, contact = roles(discrete)
    S_n, S_c = stiffness(neumann, both=True), stiffness(contact, both=k != 0)
    n, m, t = len(contact["surface"]), len(neumann["surface"]), len(contact["surface"]) if k else 0
    P = matrix(discrete["transfer"], n, m) if discrete["transfer"] else identity(n)
    demand(P.ncols() == m, "a transfer between contact nodes that differ")
    weights = [rational(w) for w in discrete["weights"]]
    grids(discrete)
    demand("radius" not in claim or hat(discrete, claim["radius"]), "a kernel that is the hat of the radius claimed")
    # rows: forms in (d, c).  Without friction p_T = 0, and c is only the normal trace
    at = lambda body, which: [(j, both[q]) for q in which for j, both in enumerate(axes(body))]
    onto = at(contact, (0, 1) if k else (1,))
    across = arb_mat([[P[i, j] * dot(u, w) for j, w in at(neumann, (0, 1))] for i, u in onto])
    p = stacked([[arb_mat(t + n, 2 * m), S_c]]).tolist()
    v = (-stacked([[across, identity(t + n)]])).tolist()
    moved = across.transpose() * S_c  # P' p
    corner, mixed = (factor**2 - (1 - theta) ** 2) * S_n, -theta * (1 - theta) * moved
    square = -(theta**2) * moved.transpose() * S_n.solve(moved)
    form = stacked([[corner, mixed], [mixed.transpose(), square]])
    rubs, zeta = [k * w for w in weights[:t]], []
    if k:
        pressure = matrix(discrete["kernel"], n, m) * part(S_n, range(m, 2 * m), range(2 * m))
        zeta = stacked([[pressure, arb_mat(n, 2 * n)]]).tolist()

    def product(kind, j, case, sign):
        """Two forms, one of which is 0 on the pieces of a case."""
        demand(j in range(n if kind == "normal" else t), "a contact node")
        if kind == "normal" or (kind, case) == ("slip", -1):
            return [v[j] if kind == "slip" else v[t + j] if case > 0 else p[t + j]] * 2
        excess = [x - sign * rubs[j] * y for x, y in zip(p[j], zeta[j], strict=True)]
        return excess, (v[j] if kind == "signs" else excess)

    for leaf, cases in leaves(claim["multipliers"]):
        lam, tau, a, b = (spread(leaf[name], n) for name in ("lambda", "tau", "a", "b"))
        demand(all(x >= 0 for x in lam + tau + a + b), "multipliers that are not negative")
        demand(all(4 * x * y >= z * z for x, y, z in zip(a, b, tau, strict=True)), "4 a b >= tau^2")
        values = tau[:t] + lam + [w * x for each in (a, b) for w, x in zip(rubs, each[:t], strict=True)]
        values += [rational(x) for x in leaf.get("equal", [])]
        pairs = [*zip(p + zeta + v[:t], v + zeta + v[:t], strict=True), *(product(*case) for case in cases)]
        demand(len(values) == len(pairs), "one more multiplier for each case")
        left, right = (arb_mat(list(rows)) for rows in zip(*pairs, strict=True))
        total = left.transpose() * scaled(values, right)
        demand(definite(form - (total + total.transpose()) / 2), "multipliers that prove it in balls of these bits")


def leaves(tree, cases=(), signs=()):
    """The leaves of a tree, each with its cases: kind of division, contact node, 1 or -1, and the sign of the node."""
    if "cases" not in tree:
        yield tree, cases
        return
    kind, j, branches, signs = tree["divided"], tree["node"], tree["cases"], dict(signs)
    demand(len(branches) == 2, "both cases of each division")
    demand(kind in ("normal", "signs") or (kind == "slip" and j in signs), "normal, signs, or then slip")
    for branch, case in zip(branches, (1, -1), strict=True):
        known = {**signs, j: case} if kind == "signs" else signs
        yield from leaves(branch, (*cases, (kind, j, case, known.get(j))), known)


def surface_stiffness(body, both):
    """The Schur complement on the contact nodes: tangential components first, then normal ones; or only these."""
    points = [[rational(x) for x in point] for point in body["points"]]
    young, nu = rational(body["young"]), rational(body["poisson"])
    demand(young > 0 and -1 < nu < fmpq(1, 2), "E > 0 and -1 < nu < 1/2")
    first, second = young * nu / ((1 - 2 * nu) * (1 + nu)), young / (2 * (1 + nu))  # Lame
    held = {(node, p) for node, p in body["held"]}
    named = {i for cell in body["cells"] for i in cell} | set(body["surface"]) | {node for node, _ in held}
    demand(all(type(i) is int and 0 <= i < len(points) for i in named), "node numbers")
    rows, upright = {}, ((1, 0), (0, 1))
    turned = {node: both for node, both in zip(body["surface"], axes(body), strict=True) if both != upright}
    demand(not any(node in turned for node, _ in held), "no support of a contact node with its own normal")
    for cell in body["cells"]:
        (x0, y0), (x1, y1), (x2, y2) = (points[i] for i in cell)
        twice = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        demand(twice > 0, f"cell {cell} anticlockwise, of positive area")
        slope = [(y1 - y2, x2 - x1), (y2 - y0, x0 - x2), (y0 - y1, x1 - x0)]  # gradients times twice the area
        for i, g in zip(cell, slope, strict=True):
            for j, h in zip(cell, slope, strict=True):
                for p, u in enumerate(turned.get(i, upright)):
                    for q, w in enumerate(turned.get(j, upright)):
                        if (i, p) not in held and (j, q) not in held:
                            shear = dot(g, w) * dot(h, u) + dot(g, h) * dot(u, w)
                            value, row = first * dot(g, u) * dot(h, w) + second * shear, rows.setdefault((i, p), {})
                            row[j, q] = row.get((j, q), 0) + value / (2 * twice)
    apart([[points[i] for i in cell] for cell in body["cells"]])
    keep = [(node, p) for p in ((0, 1) if both else (1,)) for node in body["surface"]]
    demand(len(set(keep)) == len(keep) and not held & set(keep), "contact nodes that are free, each once")
    kept, done = set(keep), []
    inside = sorted(set(rows) - kept, key=lambda unknown: (points[unknown[0]], unknown))
    for start in range(0, len(inside), BLOCK):
        block = inside[start : start + BLOCK]
        near = set().union(*(rows[i] for i in block)) - set(block)
        front, reached = sorted(near - kept), sorted(near & kept)
        beside = front + reached
        # for so few unknowns radii grow less from block to block by this method than by default
        solved = gathered(rows, block, block).solve(gathered(rows, block, beside), algorithm="lu")
        lessen(rows, front, beside, gathered(rows, block, front).transpose() * solved)
        for i in front:
            for j in block:
                rows[i].pop(j, None)
        for i, line in zip(block, solved.tolist(), strict=True):
            done.append((rows.pop(i), dict(zip(beside, line, strict=True))))
        if len(done) >= BATCH or start + BLOCK >= len(inside):  # one large product takes half of the time of several
            reached = [j for j in keep if any(j in row for row, _ in done)]
            coupling, solved = (gathered(some, range(len(done)), reached) for some in zip(*done, strict=True))
            lessen(rows, reached, reached, coupling.transpose() * solved)
            done = []
    return gathered(rows, keep, keep)


def apart(cells):
    """Demand that no two cells overlap: of two triangles that do not, one has a side with the other beyond it."""
    turn = lambda a, b, c: (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
    beyond = lambda one, other: any(all(turn(one[i - 1], one[i], at) <= 0 for at in other) for i in range(3))
    spans = ([(min(x), max(x)) for x in zip(*cell, strict=True)] for cell in cells)
    near = []
    for ((left, right), (low, high)), cell in sorted(zip(spans, cells, strict=True)):
        near = [other for other in near if other[0] > left]
        for _, bottom, top, other in near:
            clear = bottom >= high or top <= low or beyond(cell, other) or beyond(other, cell)
            demand(clear, "cells that do not overlap, each listed once")
        near.append((right, low, high, cell))


def roles(discrete):
    """The Neumann body and the contact body."""
    demand(discrete["neumann_body"] in (1, 2), "neumann_body 1 or 2")
    return [discrete[f"body{i}"] for i in ((2, 1) if discrete["neumann_body"] == 2 else (1, 2))]


#: Positions in doubles, or along a line with corners, are rounded: a rule for the weights and the kernel is met so far.
close = lambda one, other, size: abs(one - other) < size / 10**6


def grids(discrete):
    """Positions of the contact nodes and of the Neumann nodes, along x or along both lines, as the weights have it."""
    neumann, contact = map(positions, roles(discrete))
    weights = [rational(w) for w in discrete["weights"]]
    for own, other in zip(contact, neumann, strict=True):
        widths = [b - a for a, b in pairwise(own)]
        halves = [(a + b) / 2 for a, b in zip([0, *widths], [*widths, 0], strict=True)]
        if len(halves) == len(weights) and all(close(w, h, h) for w, h in zip(weights, halves, strict=True)):
            return own, (other if discrete["transfer"] else own)
    raise Refused("needed the trapezoid weights of the contact nodes")


def positions(body):
    """Abscissas of the contact nodes, and distances along their line."""
    nodes = [[arb(rational(x)) for x in body["points"][i]] for i in body["surface"]]
    lengths = (((a - x) ** 2 + (b - y) ** 2).sqrt() for (a, b), (x, y) in pairwise(nodes))
    return [x for x, _ in nodes], [*accumulate(lengths, initial=arb(0))]


def hat(discrete, radius):
    """True if the kernel is the hat of a radius on the grids."""
    r, (own, other) = arb(rational(radius)), grids(discrete)
    wanted = [[arb(0).max(1 - abs(x - y) / r) / r for y in other] for x in own]
    listed = matrix(discrete["kernel"], len(own), len(other)).tolist()
    return all(close(a, b, 1 / r) for rows in zip(listed, wanted, strict=True) for a, b in zip(*rows, strict=True))


def axes(body):
    """Tangent and normal of each contact node; along x and y where the body lists none."""
    given = body.get("normals") or [["0", "1"]] * len(body["surface"])
    normals = [(rational(x), rational(y)) for x, y in given]
    demand(len(normals) == len(body["surface"]) and all(dot(n, n) == 1 for n in normals), "normals of length 1")
    return [((y, -x), (x, y)) for x, y in normals]


def lessen(rows, wanted, columns, less):
    """Subtract a matrix from the entries of some rows."""
    left = gathered(rows, wanted, columns) - less
    for i, line in zip(wanted, left.tolist(), strict=True):
        rows[i].update(zip(columns, line, strict=True))


def definite(form):
    """True if every symmetric matrix in these balls is positive definite: by halves and their Schur complement."""
    n = form.nrows()
    if n == 1:
        return bool(form[0, 0] > 0)
    head, tail = range(n // 2), range(n // 2, n)
    A, B, C = part(form, head, head), part(form, head, tail), part(form, tail, tail)
    return definite(A) and definite(C - B.transpose() * A.solve(B))


def demand(holds, needed):
    if not holds:
        raise Refused(f"needed {needed}")


def rational(text):
    demand(isinstance(text, str) and re.fullmatch(r"-?\d{1,2000}(/\d{1,2000})?", text), f"a rational, not {text!r}")
    return fmpq(*(int(part) for part in text.split("/")))


def spread(values, n):
    """A multiplier for each node, or one for all of them."""
    found = [rational(x) for x in (values if isinstance(values, list) else [values] * n)]
    demand(len(found) == n, f"{n} multipliers of each kind")
    return found


def matrix(rows, n, m):
    demand(len(rows) == n and all(len(row) == m for row in rows), f"a matrix of {n} x {m}")
    return arb_mat([[arb(rational(x)) for x in row] for row in rows])


def stacked(blocks):
    """A matrix from rows of matrices side by side."""
    beside = lambda row: zip(*(block.tolist() for block in row), strict=True)
    return arb_mat([[entry for line in lines for entry in line] for row in blocks for lines in beside(row)])


def words(document):
    """The claim and its bodies, for a reader."""
    discrete, claim = document["discrete"], document["claim"]
    bodies = [
        f"{name}: {len(body['points'])} nodes, {len(body['cells'])} triangles, E {body['young']}, nu {body['poisson']}"
        for name, body in ((name, discrete[name]) for name in ("body1", "body2"))
    ]
    kernel = f"k {discrete['friction']} with the "
    kernel += f"hat kernel of radius {claim['radius']}" if "radius" in claim else "kernel that it lists"
    friction = kernel if rational(discrete["friction"]) else "no friction"
    at = f"Neumann problem: body {discrete['neumann_body']}, {friction}, theta {claim['theta']}"
    spare = 1 - rational(claim["factor"])
    return "; ".join([*bodies, at, f"Lipschitz constant at most 1 - {float(arb(spare).mid()):.10g}"])


def examine(document):
    """Raise one of UNREADABLE unless a certificate proves its claim."""
    demand(document["sha256"] == digest(document["discrete"]), "the hash of its own bodies")
    check(document["discrete"], document["claim"])


def show(text):
    """Print a text that may come from the certificate on one line, without what steers a terminal."""
    print("".join(c if c.isprintable() else ascii(c)[1:-1] for c in text))


def main(path):
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


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]) if len(sys.argv) == 2 else "needed: python check.py certificate.json")
