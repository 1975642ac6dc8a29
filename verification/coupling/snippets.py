"""Lines for the configuration of a coupling library: the roles, theta, and which solver reads which field.

The keys are those of preCICE 3.4.1, of the CoSimulationApplication of Kratos Multiphysics and of Norma.jl 0.1.0;
``docs/coupling.md`` names the files of their sources that have them.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from textwrap import indent
from typing import Literal

from verification.coupling.kinds import METHODS

#: The residual at which a snippet stops the iteration, over the size of the forces.
TOLERANCE = 1e-6

#: The most iterations that a snippet allows, as a multiple of the steps to 1e-9, and where these are not known.
ROOM, UNKNOWN = 2, 200


@dataclass(frozen=True, kw_only=True)
class CouplingScheme:
    """Content of a snippet; the solver of the Neumann body reads forces and writes displacements.

    That body is None where advice is for the roles that a run had.  ``steps`` are to 1e-9 of the first error, by the
    rate of the advice; ``data`` are the names of the relaxed data in preCICE.
    """

    neumann_body: Literal[1, 2] | None
    theta: float
    steps: int | None
    tied: bool = False
    data: tuple[str, ...] = ("Force",)

    @property
    def neumann(self) -> str:
        """The name of the participant that reads forces."""
        return "NeumannBody" if self.neumann_body is None else f"Body{self.neumann_body}"

    @property
    def contact(self) -> str:
        """The name of the participant that reads displacements."""
        return "ContactBody" if self.neumann_body is None else f"Body{3 - self.neumann_body}"

    @property
    def iterations(self) -> int:
        """The most iterations to allow."""
        return UNKNOWN if self.steps is None else max(10, ROOM * self.steps)


def snippet(library: str, coupling: CouplingScheme, method: str = "constant") -> str:
    """The snippet for a library.

    Parameters
    ----------
    library : {'preCICE', 'Kratos', 'Norma'}
    coupling : CouplingScheme
    method : {'constant', 'aitken', 'iqn-ils'}
        How the exchange is relaxed; theta is the first factor of the last two, which adapt.

    Raises
    ------
    ValueError
        No snippet has that name, or the library has no such method.

    Examples
    --------
    >>> print(snippet("Norma", CouplingScheme(neumann_body=1, theta=0.8, steps=14)).splitlines()[3])
    domains: ["body2.yaml", "body1.yaml"]
    """
    if library not in SNIPPETS:
        raise ValueError(f"{library}: needed one of {', '.join(SNIPPETS)}")
    if method not in METHODS:
        raise ValueError(f"method {method!r}: needed one of {', '.join(METHODS)}")
    return SNIPPETS[library](coupling, method)


#: The accelerations of preCICE, and their tag of the factor, or of the first one.
ACCELERATIONS = {
    "constant": "constant relaxation",
    "aitken": "aitken initial-relaxation",
    "iqn-ils": "IQN-ILS initial-relaxation",
}


def precice(c: CouplingScheme, method: str) -> str:
    """The coupling scheme; the relaxed data are those that the second participant sends to the first.

    Both fields live on the mesh of the Neumann body, to which the other participant maps: displacements consistently,
    forces conservatively, which is the transposed map.
    """
    mesh, acceleration = f"{c.neumann}-Mesh", indent(precice_acceleration(c, method), "  ")
    return f"""\
<!-- {c.neumann}, the Neumann body, reads Force and writes Displacement;
     {c.contact}, the contact body, reads Displacement and writes Force. -->
<coupling-scheme:serial-implicit>
  <participants first="{c.neumann}" second="{c.contact}" />
  <time-window-size value="1" />
  <max-time-windows value="1" />
  <max-iterations value="{c.iterations}" />
  <exchange data="Displacement" mesh="{mesh}"
            from="{c.neumann}" to="{c.contact}" />
  <exchange data="Force" mesh="{mesh}"
            from="{c.contact}" to="{c.neumann}" />
  <relative-convergence-measure data="Force" mesh="{mesh}"
                                limit="{TOLERANCE:g}" />
{acceleration}
</coupling-scheme:serial-implicit>"""


def precice_acceleration(c: CouplingScheme, method: str) -> str:
    """The element of the acceleration; a rule that adapts its factor must name the data."""
    tag, factor = ACCELERATIONS[method].split()
    data = [f'\n  <data name="{name}" mesh="{c.neumann}-Mesh" />' for name in c.data if method != "constant"]
    return f'<acceleration:{tag}><{factor} value="{c.theta:g}" />{"".join(data)}</acceleration:{tag}>'


#: The convergence accelerators of Kratos, and their names of the factor, or of the first one and its upper limit.
ACCELERATORS = {
    "constant": "constant_relaxation alpha",
    "aitken": "aitken init_alpha init_alpha_max",
    "iqn-ils": "iqnils alpha",
}

#: The parameters of Kratos.
_KRATOS = """
{"problem_data": {"start_time": 0.0, "end_time": 1.0, "parallel_type": "OpenMP", "echo_level": 1},
 "solver_settings": {"type": "coupled_solvers.gauss_seidel_strong", "echo_level": 1,
  "num_coupling_iterations": %(most)d,
  "convergence_accelerators": [{"type": "%(type)s", "solver": "%(one)s", "data_name": "force",
   %(factors)s, "echo_level": 4}],
  "convergence_criteria": [{"type": "relative_norm_previous_residual", "solver": "%(one)s", "data_name": "force",
   "abs_tolerance": 1e-12, "rel_tolerance": %(tolerance)r, "echo_level": 3}],
  "data_transfer_operators": {"mapper": {"type": "kratos_mapping",
   "mapper_settings": {"mapper_type": "nearest_neighbor"}}},
  "coupling_sequence": [{"name": "%(one)s", "input_data_list": [], "output_data_list": []},
   {"name": "%(other)s", "input_data_list": [{"data": "displacement", "from_solver": "%(one)s",
     "from_solver_data": "displacement", "data_transfer_operator": "mapper"}],
    "output_data_list": [{"data": "force", "to_solver": "%(one)s", "to_solver_data": "force",
     "data_transfer_operator": "mapper", "data_transfer_operator_options": ["use_transpose", "swap_sign"]}]}],
  "solvers": {"%(one)s": %(point_load)s, "%(other)s": %(reaction)s}}}"""

#: A solver with the data displacement and force.
_SOLVER = """
{"type": "solver_wrappers.kratos.structural_mechanics_wrapper",
 "solver_wrapper_settings": {"input_file": "ProjectParameters%s"}, "data": {
  "displacement": {"model_part_name": "Structure.Interface", "variable_name": "DISPLACEMENT", "dimension": 2},
  "force": {"model_part_name": "Structure.Interface", "variable_name": "%s", "dimension": 2}}}"""


def kratos(c: CouplingScheme, method: str) -> str:
    """The parameters of CoSimulation for two plane structural models, each with an input file and a part Interface.

    With these levels of output the log has what ``advise run --log`` reads: residuals and the names of accelerators.
    """
    accelerator, *names = ACCELERATORS[method].split()
    known = {
        "one": c.neumann,
        "other": c.contact,
        "type": accelerator,
        "most": c.iterations,
        "tolerance": TOLERANCE,
        "factors": ", ".join(f'"{name}": {c.theta!r}' for name in names),
        "point_load": _SOLVER % (c.neumann, "POINT_LOAD"),
        "reaction": _SOLVER % (c.contact, "REACTION"),
    }
    return json.dumps(json.loads(_KRATOS % known), indent=2)


def norma(c: CouplingScheme, method: str) -> str:
    """The controller file and a boundary condition for each body; the domain listed first reads displacements."""
    if method != "constant":
        raise ValueError(f"Norma, method {method!r}: needed 'constant', the block has no other")
    one, other = c.neumann.lower(), c.contact.lower()
    contact = lambda source: (
        f"""\
boundary conditions:
  Schwarz contact:
    - side set: contact
      source: {source}
      source side set: contact
      friction type: {"tied" if c.tied else "frictionless"}"""
    )
    return f"""\
# the file of the controller; {other}, listed first, reads displacements,
# {one} reads forces, and theta relaxes the displacements
type: multi
domains: ["{other}.yaml", "{one}.yaml"]
initial time: 0.0
final time: 1.0
time step: 1.0
minimum iterations: 1
maximum iterations: {c.iterations}
relative tolerance: {_with_point(TOLERANCE)}
absolute tolerance: 1.0e-12
relaxation parameter: {_with_point(c.theta)}
---
# into {other}.yaml, the contact body
{contact(one)}
---
# into {one}.yaml, the Neumann body
{contact(other)}"""


def _with_point(number: float) -> str:
    """A number as YAML reads one: 1e-05 is a text there.

    >>> _with_point(1e-05), _with_point(0.808)
    ('1.0e-05', '0.808')
    """
    mantissa, e, power = f"{number:g}".partition("e")
    return f"{mantissa}.0{e}{power}" if e and "." not in mantissa else f"{mantissa}{e}{power}"


#: The libraries whose block has constant relaxation only; Norma.jl itself has Aitken's, too.
ONLY_CONSTANT = ("Norma",)

#: The snippets by the name of the library.
SNIPPETS: dict[str, Callable[[CouplingScheme, str], str]] = {"preCICE": precice, "Kratos": kratos, "Norma": norma}
