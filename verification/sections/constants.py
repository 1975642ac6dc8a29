"""The constants of a problem on its mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from verification import registry
from verification.constants import Measured
from verification.constants.measured import ENERGY_NAMES, NAMES
from verification.interface import assembly
from verification.sections.setting import setting
from verification.show.numbers import between, figures
from verification.show.parts import Note, Section, Sections, Shown, closing, following, section, table

#: The constants that a comparison shows.
COMPARED = ("m", "M", "C_R", "C_s", "C_tr", "C_K", "rho_max")

#: What each constant measures, in at most 40 characters; norms are those of H^1, where no energy is named.
WORDS = {
    "m": "least energy (doubled) at norm 1",
    "M": "sum of both largest energies, doubled",
    "C_R": "largest norm of a lift per trace norm",
    "C_s": "largest smoothed pressure at norm 1",
    "C_tr": "largest tangential trace at norm 1",
    "C_tr_half": "the same in the trace norm of (5.8)",
    "C_K": "k C_s C_tr: how friction enters",
    "rho_max": "stiffness, contact / Neumann, at most",
    "rho_min": "stiffness, contact / Neumann, at least",
    "rho_normal": "rho_max without friction",
    "C_s_energy": "smoothed pressure at energy 1, Neumann",
    "C_t1": "tangential trace at energy 1, contact",
    "C_t2": "tangential trace at energy 1, Neumann",
    "kappa_1": "k C_s_energy C_t1, contact body",
    "kappa_2": "k C_s_energy C_t2, Neumann body",
}


@registry.sections.register
def sections(measured: Measured) -> Sections:
    """The sections; none if the constants come from matrices without a problem."""
    problem = measured.problem
    if problem is None:
        return ()
    levels = measured.levels or (measured,)
    parts: list[Shown] = []
    if measured.unverified is not None:
        parts += [part for level in levels for part in _between_bounds(level, (*NAMES, *ENERGY_NAMES))]
    else:
        unit = _units(measured)
        words = WORDS if len(levels) == 1 else {}  # several columns leave no room
        rows = [
            (
                name,
                *(figures(getattr(level, name), 6, unit.get(name, "")) for level in levels),
                unit.get(name, ""),
                *([words[name]] if words else []),
            )
            for name in (*NAMES, *ENERGY_NAMES)
        ]
        head = ("nodes", *(str(level.nodes) for level in levels), "unit", *([""] if words else []))
        parts.append(table(head, rows, right=range(1, len(levels) + 1)))
    parts.append(_cells(measured))
    numbers = [getattr(level, name) for level in levels for name in (*NAMES, *ENERGY_NAMES)]
    if any(number is not None and number.level == "verified" for number in numbers):
        ends = "verified: between two bounds proved for the exact data of the file on this mesh, rounding included."
    else:
        ends = "These numbers hold for this mesh, up to rounding. Only rho_max affects the choice of theta."
    for reason in dict.fromkeys(measured.reason.values()):
        names = ", ".join(name for name, why in measured.reason.items() if why == reason)
        parts.append(Note(f"{names}: {reason}"))
    mesh = "On a mesh m is above and M below its continuous value"
    unsafe = "For the continuous problem both make the theorem look better than it is."
    then = following("advise" if measured.interface_nodes > assembly.MOST_CONTACT_NODES else "compare")
    title = "WHICH CONSTANTS DOES THE THEOREM USE?"
    caption = "The constants on this mesh: first Section 5, then rho and the theorem in energy norms."
    return (
        setting(problem, measured.nodes, measured.interface_nodes, measured.cuts),
        section("all constants", title, *parts, caption=caption),
        closing("", Note(ends, 0), Note(f"{mesh}. {unsafe}", 0), then=then),
    )


def _cells(measured: Measured) -> Note:
    """One line about short waves, which exist on every mesh."""
    rho, rho_normal = measured.rho_cells, measured.rho_normal_cells
    if rho is None or rho_normal is None:
        return Note(f"rho_cells, rho_normal_cells: {measured.why_no_cells}")
    both = f"rho_cells = {figures(rho, 5)}, rho_normal_cells = {figures(rho_normal, 5)}"
    where = "computed for half-planes of the file's cells, halved once"
    return Note(f"{both}, {where}. On finer meshes rho tends to at least these values.")


def compared(measured: Measured) -> Section:
    """Those that a comparison shows with their proved bounds."""
    parts = _between_bounds(measured, COMPARED)
    caption = "The constants of the theorem on this mesh, with the bounds proved of them."
    return section("constants", "HOW LARGE ARE THE CONSTANTS?", *parts, caption=caption)


def _units(measured: Measured) -> Mapping[str, str]:
    """The unit of each constant that has one."""
    stress, length = measured.units["stress"], measured.units.get("length", "")
    units = dict.fromkeys(("m", "M", "C_K"), stress)
    if length:
        units |= {
            "C_s": f"{stress}/sqrt({length})",
            "C_tr": f"sqrt({length})",
            "C_s_energy": f"sqrt({stress}/{length})",
        }
        units |= dict.fromkeys(("C_t1", "C_t2"), f"sqrt({length}/{stress})")
    return units


def _between_bounds(measured: Measured, names: Sequence[str]) -> list[Shown]:
    """Constants with their proved bounds, and the reasons where there are none."""
    units, rows = _units(measured), []
    roots = {name: unit for name, unit in units.items() if name in names and "sqrt" in unit}  # too wide for the table
    for name in names:
        number, unit = getattr(measured, name), "" if name in roots else units.get(name, "")
        level = "" if number is None else number.level
        rows.append((name, figures(number, 4, unit), *between(number, unit=unit), level, unit))
    head = (f"{measured.nodes} nodes", "about", "at least", "at most", "level", "unit")
    why = {name: reason for name, reason in (measured.unverified or {}).items() if name in names}
    return [
        table(head, rows, right=(1, 2, 3)),
        *([Note("units: " + ", ".join(f"{name} in {unit}" for name, unit in roots.items()))] if roots else []),
        *(
            Note(f"not proved, {', '.join(name for name in why if why[name] == reason)}: {reason}")
            for reason in dict.fromkeys(why.values())
        ),
    ]
