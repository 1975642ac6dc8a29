"""Safeguards of the proofs in doubles, each with a mutant that takes it away: a line of the program, and another one.

A safeguard is a bound of rounding errors, a step outwards, or a branch that keeps a number on its safe side.  Tests
that pass without it defend nothing, whatever they say.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Mutant:
    """One change of one place in a module.

    Attributes
    ----------
    module : str
        Path of the file.
    before, after : str
        What stands there, once in the file, and what the mutant has instead.
    covered : str
        Why no test can fail without this safeguard, because another one covers it; empty for all others.
    """

    module: str
    before: str
    after: str
    covered: str = ""

    @property
    def name(self) -> str:
        return f"{self.module}: {self.before} -> {self.after or 'nothing'}"


#: The tests that have to fail, by module.
TESTS: dict[str, tuple[str, ...]] = {
    "fem1d2d/proofs/enclosed.py": ("tests/safeguards/test_enclosed.py",),
    "fem1d2d/proofs/loewner.py": ("tests/safeguards/test_loewner.py",),
    "ndtheory/energy_norms.py": ("tests/safeguards/test_energy_safe.py",),
    "verification/coupling/from_logs.py": (
        "tests/verification/coupling/test_from_logs.py",
        "tests/verification/coupling/test_runs_with_friction.py",
        "tests/verification/coupling/test_next_run.py",
        "tests/verification/coupling/test_near_minus_one.py",
    ),
    "verification/algorithm/rates.py": ("tests/safeguards/test_rates_safe.py",),
    "verification/semidefinite/conditions.py": ("tests/safeguards/test_multipliers_safe.py",),
    "verification/semidefinite/multipliers.py": ("tests/safeguards/test_multipliers_safe.py",),
    "verification/contact/kkt.py": ("tests/safeguards/test_kkt.py",),
    "verification/dense.py": ("tests/safeguards/test_kkt.py",),
    "verification/interface/joining.py": ("tests/safeguards/test_joining.py",),
}

# --- why some cannot be missed ----------------------------------------------------------------------------------------

SPARE = "a row of n entries needs ``gamma(n + 1)`` and has ``gamma(n + 3)``: 2/(n + 3) of it is spare, more than n UNIT"
TEN = "``upwards(.., 8)`` follows, with ten roundings to spare where five are needed"
TRIANGLE = (
    "where A - M is dominant beyond the errors A is at least M, whatever L is; where M - A is so and A definite, L has "
    "an inverse in the rows inside, which is all that its shape is needed for"
)

MUTANTS: dict[str, list[tuple[str, ...]]] = {
    "fem1d2d/proofs/enclosed.py": [
        ("/ (1 - n * UNIT) * (1 + 4 * UNIT)", "/ (1 - n * UNIT)"),
        ("/ (1 - n * UNIT) * (1 + 4 * UNIT)", "* (1 + 4 * UNIT)"),
        ("x * (1 + 2 * gamma(n + 2)) + TINY", "x + TINY"),
        ("x * (1 + 2 * gamma(n + 2)) + TINY", "x * (1 + 2 * gamma(n + 2))"),
        ("np.where(middle == exact, 0.0, UNIT * np.abs(middle))", "0.0 * middle"),
        ("4 * UNIT * size", "UNIT * size"),
        ("(1 + 16 * UNIT) * radius)", "radius)"),
        ("radius = abs(factor) * self.radius", "radius = factor * self.radius"),
        ("+ abs(times) * other.radius", "+ times * other.radius"),
        ("size = abs(factor) * abs(self.middle) + abs(times) * abs(other.middle)", "size = abs(middle)"),
        ("if not all(SMALLEST <= abs(a) <= LARGEST for a in (factor, times)):", "if False:"),
        ("gamma(n + 1) * size", "gamma(1) * size"),
        ("np.abs(A) @ other.radius + ", ""),
        ("self.radius @ (np.abs(B) + other.radius)", "self.radius @ np.abs(B)"),
        ("radius=upwards(radius, 2 * n + 4)", "radius=radius"),
        ("error = self.radius @ sizes + ", "error = "),
        ("gamma(terms + 1) * (abs(self.middle) @ sizes)", "gamma(1) * (abs(self.middle) @ sizes)"),
        ('if exact.dtype.kind not in "iO" or any(isinstance(entry, float) for entry in exact.flat):', "if False:"),
        ("if not ((sizes <= LARGEST) & ((sizes >= SMALLEST) | (exact == 0))).all():", "if False:"),
        ("upwards(np.asarray(matrix.sum(axis=1)).ravel(), terms)", "np.asarray(matrix.sum(axis=1)).ravel()"),
    ],
    "fem1d2d/proofs/loewner.py": [
        ("gamma(terms + 3) * products", "gamma(1) * products"),
        ("upwards(sizes.T @ np.ones(n), n)", "sizes.T @ np.ones(n)", SPARE),
        ("upwards(sizes @ (pivots * columns), terms + 2)", "sizes @ (pivots * columns)", SPARE),
        ("+ n * TINY, 4)", ", 4)", "``upwards`` adds TINY as well, here and where the errors enter"),
        ("upwards(self._errors(L, pivots) + self.radius, 2)", "upwards(self.radius, 2)"),
        ("upwards(self._errors(L, pivots) + self.radius, 2)", "upwards(self._errors(L, pivots), 2)"),
        ("upwards(self._errors(L, pivots) + self.radius, 2)", "self._errors(L, pivots) + self.radius", TEN),
        ("total(abs(residual)) - np.abs(own)", "0 * own"),
        ("if not (side * own * (1 - 8 * UNIT) >= beside)[self.inside].all():", "if False:"),
        ("(side * own * (1 - 8 * UNIT) >= beside)", "(abs(own) >= beside)"),
        ("side * own * (1 - 8 * UNIT)", "side * own", "``beside`` is made larger by 20 UNIT, and six are needed"),
        ("errors, 8)", "errors, -2)", "``own`` is made smaller by 8 UNIT, and six are needed; the errors hold TINY"),
        ("(pivots > 0).all() and ", ""),
        ("triangular and ", "", TRIANGLE),
        ("np.array_equal(place, factor.perm_c) and ", "", TRIANGLE),
        (" and np.isfinite(L.data).all()", "", "a residual that is not finite fails the comparison"),
        ("wrong = total(np.abs(dense - symmetric)) + ", "wrong = ", "both triangles lie within the errors"),
        ("total(np.abs(dense)) * 2 * UNIT + ", ""),
        ("+ rest + errors", "+ errors"),
        ("+ rest + errors", "+ rest"),
        ("- side * upwards(wrong, 8)", "- upwards(wrong, 8)"),
        ("np.nextafter(moved, -side * np.inf)", "moved", "of 2 UNIT times the entries in ``wrong`` one is spare"),
        ("return symmetric if np.isfinite(symmetric).all() else None", "return symmetric"),
        ("if not (np.isfinite(middle).all() and (own > 0).all()):", "if False:"),
        ("2.0 ** -np.round(np.log2(own) / 2)", "own**-0.5", SPARE),
    ],
    "ndtheory/energy_norms.py": [
        ("(s + sqrt(s * s + 4 * kappa_2)) / 2", "(s + sqrt(s * s + 2 * kappa_2)) / 2"),
        ("(2 * r - kappa_1) / ((2 + rho) * r - kappa_1)", "2 / (2 + rho)"),
        ("        theta >= turning_theta(rho, kappa_1, kappa_2),", "        theta > 2 / (2 + rho),"),
        ("where(kappa_1 == 0, 0 * theta, lambda: (", "where(True, 0 * theta, lambda: ("),
        (
            "where(kappa_1 == 0, 0 * theta, lambda: (",
            "where(False, 0 * theta, lambda: (",
            "below the turning theta ``2 - (2 + rho) theta`` is positive, and 0 over it is 0",
        ),
        ("return theta * slope * (2 - theta * slope)", "return theta * slope"),
        ("bend = where(kappa_1 == 0, 0, lambda: (1 -", "bend = where(True, 0, lambda: (1 -"),
        ("bend = where(kappa_1 == 0, 0, lambda: (1 -", "bend = where(False, 0, lambda: (1 -"),
        ("turned = theta >= turning_theta(rho, kappa_1, kappa_2)", "turned = True"),
        ("turned = theta >= turning_theta(rho, kappa_1, kappa_2)", "turned = False"),
        ("bend = where(kappa_1 == 0, 0, lambda: 2 *", "bend = where(True, 0, lambda: 2 *"),
        ("bend = where(kappa_1 == 0, 0, lambda: 2 *", "bend = where(False, 0, lambda: 2 *"),
        ("return kappa_2 + kappa_1**2 / 4", "return kappa_1**2 / 4"),
        ("2 / (kappa_2 + sqrt(kappa_2**2 + kappa_1**2))", "1 / (kappa_2 + kappa_1**2 / 4)"),
        ("kappa_1 * (root - 1 / root) < 2 * kappa_2", "kappa_1 * (root - 1 / root) < kappa_2"),
        ("kappa_1 * (root - 1 / root) < 2 * kappa_2", "kappa_1 * (root - 1 / root) < 4 * kappa_2"),
        ("kappa_1 * (root - 1 / root) < 2 * kappa_2", "True"),
        ("kappa_1 * (root - 1 / root) < 2 * kappa_2", "False"),
        ("(1 + 1 / rho) / (kappa_2 + kappa_1 / root)", "(1 + 1 / rho) / (kappa_2 + kappa_1)"),
        ("return 2 / (2 + rho)\n", "return 2 / (1 + rho)\n"),
        ("return rho / (2 + rho)", "return rho / (3 + rho)"),
        ("return 2 / (2 + rho_min + rho)", "return 2 / (2 + rho)"),
        ("return (rho - rho_min) / (2 + rho_min + rho)", "return rho / (2 + rho_min + rho)"),
        ("maximum(absolute(1 - theta * (1 + rho_min)), absolute", "maximum(0, absolute"),
        ("maximum(absolute(1 - theta), absolute(1 - theta * (1 + rho)))", "absolute(1 - theta)"),
        ("maximum(absolute(1 - theta), absolute(1 - theta * (1 + rho)))", "absolute(1 - theta * (1 + rho))"),
        ("there & (margin < root) & ", "there & "),
        (" & (root < turn * (1 - margin))", ""),
        ("from_0 = c <= margin", "from_0 = c > c + 1"),
        ("from_0 = c <= margin", "from_0 = c < -margin"),
        ("beyond = end >= turn * (1 - margin)", "beyond = end > end + 1"),
        ("beyond = end >= turn * (1 - margin)", "beyond = end > turn * (1 + margin)"),
        ("minimum(end, end / end), where", "end, where"),
        ("low = where(from_0, 0 * end,", "low = where(one | True, 0 * end,"),
        ("where(other, minimum(first, second), first), second)", "first, second)"),
        (
            "where(other, maximum(first, second), first), second)",
            "first, second)",
            "``q / a`` is the root of larger modulus, so that of two positive ones it is the larger",
        ),
        ("return low, high, ends == 2", "return low, high, ends >= 1"),
        ("root = where(real, lambda: sqrt(discriminant), 0 * b)", "root = sqrt(discriminant)"),
        ("real = discriminant > margin * b * b", "real = discriminant >= 0"),
        ("where(b > 0, root, -root)", "where(b > 0, -root, root)"),
        ("(where(a != 0, lambda: q / a, 0 * b), real & (a != 0))", "(q / a, real)"),
        ("where(q != 0, lambda: c / q, 0 * b)", "c / q"),
        ("top = minimum(high, turning_theta(rho, kappa_1, kappa_2))", "top = high"),
        ("where(holds(high), high, halved)", "halved()"),
        ("float(interval[0]) == float(interval[1])", "False"),
        ("low * (1 + margin) < theta < high * (1 - margin)", "low < theta < high"),
        ("low * (1 + margin) < theta < high * (1 - margin)", "True"),
        (
            "            if gain > 0:",
            "            if True:",
            "a theta inside by the margin has a gain far above rounding",
        ),
        ("for corner in constants.corners or ()", "for corner in ()"),
    ],
    "verification/coupling/from_logs.py": [
        ("abs(log.theta - float(theta)) > off * (1 + 1e-9)", "False"),
        ("if not bare.converges and all(reading.kind", "if False and all(reading.kind"),
        ("ratio is not None and grows:", "False:"),
        ("one_mode(theta, ratio, plateau):", "True:"),
        ("lo = max(lower, key", "lo = min(lower, key"),
        ("1 + lo.value > AGREE * (1 + hi.value)", "False"),
        ("base = max(falling, key", "base = min(falling, key"),
        ("if dear <= DEAR:", "if True:"),
        ("most if tied else min([most, *rising])", "most"),
        ("*(([], []) if friction or not of.signed else bounds(seen, of))", "*bounds(seen, of)"),
        ("readings_with_friction(readings), None", "readings, rho"),
        ("hi = min(upper", "hi = max(upper"),
        ("if interval.contradiction is not None", "if False"),
        ("if not falling and len(rising) > 1", "if False"),
        ("if tied and log.diverges", "if log.diverges"),
        ("if tied and plateau is not None", "if plateau is not None"),
        ("most if tied else float(base.theta)", "most"),
        ("base = min(rising", "base = max(rising"),
        ("min(log.theta for log in logs) / 2", "max(log.theta for log in logs) / 2"),
        ("if math.isinf(stiffest):", "if False:"),
        ("stiffest, rising = max(box.b[1]", "stiffest, rising = min(box.b[1]"),
        ("if falls and kind.linear:", "if falls:"),
        ("elif lo is not None:", "elif False:"),
        ("1 - min(NARROWEST, theta / 5), 1)", "1, 1)"),
        ("lo is not None and predicted_theta(lo.value) < base.theta / 4", "False"),
        ("settled = most <= GROWS * least and not log.explodes", "settled = True"),
        (" and base.rho is None:", ":"),
        ("if tied and ratio is not None and ratio.least > 1:", "if ratio is not None and ratio.least > 1:"),
        ("2 * (1 - SETTLED) / theta", "2 / theta"),
        ("if kind.parallel and bare.stays:", "if False:"),
        ("because, SMALLEST_THETA)", "because)"),
        ("min(falls)[1]", "max(falls)[1]"),
        ("if ratio.most <= ends.SWIFT:", "if False:"),
        ("1 + low * (1 - SETTLED), 1 + high * (1 + SETTLED)", "1 + high, 1 + low"),
        ('if all(column.residual in RELATIVE for column in columns if column.count("level")):', "if False:"),
    ],
    "verification/algorithm/rates.py": [
        ("(end - begin) // 8 * 2", "(end - begin) // 4"),
        ("max(2, (end - begin) // 8 * 2)", "max(1, (end - begin) // 8 * 2)"),
        ("min(since, end - 2)", "since", "with fewer than two steps both leave the last two, and no window before"),
        ("max(begin, end - 2 * quarter), end - quarter", "end - 2 * quarter, end - quarter"),
        ("+ ([before] if before[0] < before[1] else [])", ""),
        ("residuals[j] + sign * floors[j], residuals[i] - sign", "residuals[j], residuals[i] - sign"),
        ("residuals[i] - sign * floors[i]", "residuals[i]"),
        ("min(rate(i, j, -1) for", "max(rate(i, j, -1) for"),
        ("max(rate(i, j, +1) for", "min(rate(i, j, +1) for"),
        ("residual > CLEAR_OF_NOISE * floor for", "residual > floor for"),
        ("clear.index(False) if False in clear else len(clear)", "sum(clear)"),
        ("if count < 3:", "if count < 2:"),
        ("patterns[first - 1] == patterns[-1]", "patterns[first - 1] in patterns"),
        ("self._interface = pair.interface.moduli", "self._interface = pair.interface"),
        ("np.abs(pair.contact.schur)", "pair.contact.schur"),
        ("np.abs(pair.neumann.inverse)", "pair.neumann.inverse"),
        ("np.abs(pair.neumann.schur)", "pair.neumann.schur"),
        ("np.abs(side.load)[:, None]", "side.load[:, None]"),
        ("slipped = np.abs(pair.interface.slipped)", "slipped = pair.interface.slipped"),
        ("self._load + (self", "(self"),
        ("g, u = np.abs(g), np.abs(u)", "u = np.abs(u)"),
        ("g, u = np.abs(g), np.abs(u)", "g = np.abs(g)"),
        ("self._neumann_stiffness @ u + g + self._neumann_load", "g + self._neumann_load"),
        ("self._neumann_stiffness @ u + g + self._neumann_load", "self._neumann_stiffness @ u + self._neumann_load"),
        ("self._neumann_stiffness @ u + g + self._neumann_load", "self._neumann_stiffness @ u + g"),
        ("carry(u + off)", "carry(u)"),
        (" + self._load)", ")"),
        ("added = g + ", "added = "),
        ("4 * np.finfo(float).eps", "np.finfo(float).eps"),
        ("residual[:-1] > CLEAR_OF_NOISE * floor[:-1]", "residual[:-1] > 0"),
        ("np.isfinite(residual[1:] + floor[1:])", "True"),
        ("(after - error_after) / (before + error_before)", "after / (before + error_before)"),
        ("(after - error_after) / (before + error_before)", "(after - error_after) / before"),
        ("(after + error_after) / (before - error_before)", "after / (before - error_before)"),
        ("(after + error_after) / (before - error_before)", "(after + error_after) / before"),
        ("float(lo[most]), 0.0)", "float(lo[most]), -1.0)"),
    ],
    "verification/semidefinite/conditions.py": [
        ("np.maximum(y, 0.0)", "y"),
        ("np.minimum(tau, 2 * np.sqrt(a * b) * (1 - 1e-12))", "tau"),
        ("2 * np.sqrt(a * b) * (1 - 1e-12)", "2 * np.sqrt(a * b)"),
    ],
    "verification/semidefinite/multipliers.py": [
        ("math.nextafter(root(found.value), math.inf)", "root(found.value)"),
        ("if left[k] > 0:", "if left[k] > -1e-3:"),
        ("return math.nan", "return 1.0"),
        ("(high < 1.1 * low and ", "("),
        ("<= NARROW * low * (left", "<= low * (left"),
        ("    return low\n", "    return high\n"),
        ("(theta * (1 - share), theta)", "(theta, theta)"),
        ("definite(2.0, theta * (1 - share))", "definite(2.0, theta * (1 - 2 * share))"),
        ("if not eigvalsh(rest)[0] > 0:", "if False:"),
        ("(min(value, 1.0) for value in checked)", "checked"),
        ("else least + share * size", "else least"),
        ("holds(least + share * size)", "holds(least + 2 * share * size)"),
        ("        if holds(share):", "        if True:"),
        ("if first < len(SHARES) else None", "if first < len(SHARES) else SHARES[-1]"),
        ("if safe is None:\n                    continue", "if safe is None:\n                    safe = evaluated"),
        ("if safe is None:\n            return None", "if safe is None:\n            safe = evaluated"),
    ],
    "verification/contact/kkt.py": [
        ("off[self._held] = 0.0", "off[:] = 0.0"),
        ("off[self._held] = 0.0", "pass"),
        ("free.all() else ~free", "free.all() else free"),
        ("np.abs(elastic + force - q)", "elastic + force - q"),
        ("np.abs(elastic + force - q)", "q - elastic - force"),
        ("non_penetration=worst(stretch[t:])", "non_penetration=0.0 * worst(stretch[t:])"),
        ("non_penetration=worst(stretch[t:])", "non_penetration=worst(-stretch[t:])"),
        ("compression=worst(-force[t:])", "compression=0.0 * worst(-force[t:])"),
        ("complementarity=worst(", "complementarity=0.0 * worst("),
        ("np.minimum(length[t:], size[t:])", "np.minimum(stretch[t:], size[t:])"),
        ("np.minimum(length[t:], size[t:])", "np.minimum(length[t:], force[t:])"),
        ("bound=worst(size[:t] - bound)", "bound=worst(force[:t] - bound)"),
        ("bound=worst(size[:t] - bound)", "bound=0.0 * worst(size[:t] - bound)"),
        ("slip=worst(", "slip=0.0 * worst("),
        ("bound * np.sign(v[:t])", "bound"),
        ("np.abs(force[:t] - bound * np.sign(v[:t]))", "force[:t] - bound * np.sign(v[:t])"),
        ("np.minimum(length[:t], ", "np.minimum(stretch[:t], "),
        (" or 1.0", ""),
        ("np.array([self.equilibrium, ", "np.array(["),
        ("self.compression, self", "self"),
        (" self.bound, *lengths", " *lengths"),
        ("lengths = self.non_penetration, ", "lengths = "),
        ("self.complementarity, self.slip", "self.slip"),
        ("self.complementarity, self.slip", "self.complementarity"),
        ("worst(np.array([self.equilibrium, self", "max(0.0, *np.array([self.equilibrium, self"),
    ],
    "verification/dense.py": [("float(np.maximum.reduce(values, initial=0.0))", "float(max(0.0, *values))")],
    "verification/interface/joining.py": [
        ("np.interp(grids[0].x, x, levels[1 - contact])", "0 * grids[0].x"),
        ("np.interp(grids[0].x, x, levels[1 - contact])", "levels[1 - contact].mean()"),
        ("min(x[0], contact[0])", "x[0]"),
        ("max(x[-1], contact[-1])", "x[-1]"),
        ("P.T @ trapezoid(contact)", "P.T @ np.ones(len(contact))"),
        ("if most > MOST_NODES_APART:", "if False:"),
        ("if P is not None and interface.contact_kernel is not None and", "if False and"),
        ("if not overlap[1] - overlap[0] > SAME * size:", "if not overlap[1] - overlap[0] >= 0:"),
        ("if chosen[0] < overlap[0] - SAME * size or", "if"),
        (" or chosen[1] > overlap[1] + SAME * size:", ":"),
        ("abs(x[0] - ends[0]) <= off and ", ""),
        (" and abs(x[-1] - ends[1]) <= off", ""),
        ("        if len(holes):", "        if False:"),
        ("    if not fits[contact]:", "    if False:"),
        ("float(ends[1] if upper else ends[0])", "float(ends[0] if upper else ends[1])"),
        ("other[:, -1].min() if upper", "other[:, -1].max() if upper"),
        ("else other[:, -1].max())", "else other[:, -1].min())"),
        ("levels[1] - levels[0]", "levels[0] - levels[1]"),
        ("float(problem.contact.gap)", "0.0"),
    ],
}


def mutants() -> list[Mutant]:
    """All mutants of the plan."""
    return [
        Mutant(module=module, before=before, after=after, covered="".join(covered))
        for module, listed in MUTANTS.items()
        for before, after, *covered in listed
    ]
