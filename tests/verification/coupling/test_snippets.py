"""The blocks to paste into coupling configurations: they parse, and say who reads what and by which theta."""

import json
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from collections import Counter
from itertools import product

import numpy as np
import pytest
from processes import environment

import verification as vf
from verification.coupling.methods import METHODS
from verification.coupling.snippets import SNIPPETS, CouplingScheme, snippet

#: The checker of configurations that preCICE installs.
VALIDATE = shutil.which("precice-config-validate")

#: Tags of the coupling scheme with their attributes, and how often each may be there, as preCICE 3.4.1 has them.
PRECICE = {
    "participants": ({"first", "second"}, 1),
    "time-window-size": ({"value"}, 1),
    "max-time-windows": ({"value"}, 1),
    "max-iterations": ({"value"}, 1),
    "exchange": ({"data", "mesh", "from", "to"}, 2),
    "relative-convergence-measure": ({"data", "mesh", "limit"}, 1),
    "acceleration:constant": (set(), 1),
    "acceleration:aitken": (set(), 1),
    "acceleration:IQN-ILS": (set(), 1),
    "relaxation": ({"value"}, 1),
    "initial-relaxation": ({"value"}, 1),
    "data": ({"name", "mesh"}, 1),
}

#: Keys that Norma.jl 0.1.0 requires of a controller, and those of a contact condition.
CONTROLLER = {"type", "domains", "initial time", "final time", "time step", "minimum iterations", "maximum iterations"}
CONTROLLER |= {"relative tolerance", "absolute tolerance"}
CONTACT = {"side set", "source", "source side set", "friction type"}

COUPLINGS = [
    CouplingScheme(neumann_body=body, theta=theta, steps=count, tied=tied)
    for body, theta, count, tied in ((1, 0.808, 13, False), (2, 0.1172, 167, True), (None, 1e-05, None, False))
]


def named(coupling):
    body = coupling.neumann_body
    return ("NeumannBody", "ContactBody") if body is None else (f"Body{body}", f"Body{3 - body}")


def element(text):
    """XML whose prefixes are part of the name, as preCICE reads it."""
    return ET.fromstring(re.sub(r"(</?)(coupling-scheme|acceleration):", r"\1\2..", text))


def plain(tag):
    return tag.replace("..", ":")


@pytest.mark.parametrize("coupling", COUPLINGS, ids=str)
@pytest.mark.parametrize("method", METHODS)
def test_the_preCICE_scheme_relaxes_the_forces_that_the_neumann_body_reads(coupling, method):
    neumann, contact = named(coupling)
    text = snippet("preCICE", coupling, method)
    comments = re.findall(r"<!--(.*?)-->", text, flags=re.S)
    scheme = element(re.sub(r"<!--.*?-->", "", text, flags=re.S))
    assert plain(scheme.tag) == "coupling-scheme:serial-implicit"
    found = [child for child in scheme.iter() if child is not scheme]
    for child in found:
        attributes, _ = PRECICE[plain(child.tag)]
        assert set(child.attrib) == attributes
    for tag, count in Counter(plain(child.tag) for child in found).items():
        assert count == PRECICE[tag][1]
    first, second = (scheme.find("participants").get(which) for which in ("first", "second"))
    exchanged = {e.get("data"): (e.get("from"), e.get("to")) for e in scheme.findall("exchange")}
    assert exchanged == {"Displacement": (neumann, contact), "Force": (contact, neumann)}
    # of a serial scheme preCICE relaxes what the second participant sends to the first, and nothing else
    assert (first, second) == (neumann, contact)
    measure = scheme.find("relative-convergence-measure")
    assert (measure.get("data"), measure.get("mesh")) == ("Force", f"{neumann}-Mesh")
    (acceleration,) = (child for child in scheme if child.tag.startswith("acceleration.."))
    assert acceleration.tag.removeprefix("acceleration..").lower() == method
    factor = acceleration.find("relaxation" if method == "constant" else "initial-relaxation")
    relaxed = [(data.get("name"), data.get("mesh")) for data in acceleration.findall("data")]
    assert relaxed == ([] if method == "constant" else [("Force", f"{neumann}-Mesh")])
    assert float(factor.get("value")) == coupling.theta
    assert int(scheme.find("max-iterations").get("value")) >= (coupling.steps or 1)
    assert f"{neumann}, the Neumann body, reads Force and writes Displacement" in " ".join(comments[0].split())


#: A configuration of preCICE around a coupling scheme: both bodies with a mesh each, forces mapped conservatively.
AROUND = """\
<precice-configuration>
  <data:vector name="Force" />
  <data:vector name="Displacement" />
  <mesh name="{0}-Mesh" dimensions="2"><use-data name="Force" /><use-data name="Displacement" /></mesh>
  <mesh name="{1}-Mesh" dimensions="2"><use-data name="Force" /><use-data name="Displacement" /></mesh>
  <participant name="{0}">
    <provide-mesh name="{0}-Mesh" />
    <read-data name="Force" mesh="{0}-Mesh" />
    <write-data name="Displacement" mesh="{0}-Mesh" />
  </participant>
  <participant name="{1}">
    <provide-mesh name="{1}-Mesh" />
    <receive-mesh name="{0}-Mesh" from="{0}" />
    <mapping:nearest-neighbor direction="read" from="{0}-Mesh" to="{1}-Mesh" constraint="consistent" />
    <mapping:nearest-neighbor direction="write" from="{1}-Mesh" to="{0}-Mesh" constraint="conservative" />
    <read-data name="Displacement" mesh="{1}-Mesh" />
    <write-data name="Force" mesh="{1}-Mesh" />
  </participant>
  <m2n:sockets acceptor="{0}" connector="{1}" />
  {2}
</precice-configuration>
"""


@pytest.mark.skipif(VALIDATE is None, reason="no precice-config-validate here, which comes with preCICE")
@pytest.mark.parametrize("coupling", COUPLINGS, ids=str)
@pytest.mark.parametrize("method", METHODS)
def test_preCICE_itself_accepts_its_block(tmp_path, coupling, method):
    block = snippet("preCICE", coupling, method)
    file = tmp_path / "precice-config.xml"
    for text, accepted in ((block, True), (block.replace("acceleration:", "acceleration:in"), False)):
        file.write_text(AROUND.format(*named(coupling), text), "utf-8")
        assert (subprocess.run([VALIDATE, file], capture_output=True, env=environment()).returncode == 0) == accepted


@pytest.mark.parametrize("coupling", COUPLINGS, ids=str)
@pytest.mark.parametrize("method", METHODS)
def test_the_Kratos_settings_relax_the_forces_that_the_neumann_body_reads(coupling, method):
    neumann, contact = named(coupling)
    settings = json.loads(snippet("Kratos", coupling, method))["solver_settings"]
    assert settings["type"] == "coupled_solvers.gauss_seidel_strong"  # serial; the parallel one is jacobi_strong
    (accelerator,) = settings["convergence_accelerators"]
    kind, factors = {
        "constant": ("constant_relaxation", ["alpha"]),
        "aitken": ("aitken", ["init_alpha", "init_alpha_max"]),
        "iqn-ils": ("iqnils", ["alpha"]),
    }[method]
    of_force = {"solver": neumann, "data_name": "force"}
    # level 4 names the accelerator in the log, level 3 prints residuals
    assert accelerator == {"type": kind, **of_force, **dict.fromkeys(factors, coupling.theta), "echo_level": 4}
    (criterion,) = settings["convergence_criteria"]
    assert (criterion["solver"], criterion["data_name"]) == (neumann, "force")
    assert set(criterion) - set(of_force) == {"type", "abs_tolerance", "rel_tolerance", "echo_level"}
    assert criterion["echo_level"] == 3
    first, second = settings["coupling_sequence"]
    # the second solver fetches displacements and sends forces, which the first one then has
    assert (first["name"], first["input_data_list"], first["output_data_list"]) == (neumann, [], [])
    (reads,), (writes,) = second["input_data_list"], second["output_data_list"]
    assert second["name"] == contact
    assert (reads["data"], reads["from_solver"], reads["from_solver_data"]) == ("displacement", neumann, "displacement")
    assert (writes["data"], writes["to_solver"], writes["to_solver_data"]) == ("force", neumann, "force")
    assert writes["data_transfer_operator_options"] == ["use_transpose", "swap_sign"]
    operators = {reads["data_transfer_operator"], writes["data_transfer_operator"]}
    assert operators == set(settings["data_transfer_operators"])
    assert settings["num_coupling_iterations"] >= (coupling.steps or 1)
    # structural models read loads on points, and answer with the reactions of what holds them
    variables = {name: solver["data"]["force"]["variable_name"] for name, solver in settings["solvers"].items()}
    assert variables == {neumann: "POINT_LOAD", contact: "REACTION"}
    moves = {solver["data"]["displacement"]["variable_name"] for solver in settings["solvers"].values()}
    assert moves == {"DISPLACEMENT"}


@pytest.mark.parametrize("coupling", COUPLINGS, ids=str)
def test_the_Norma_files_put_the_body_that_reads_displacements_first(coupling):
    yaml = pytest.importorskip("yaml", reason="PyYAML comes with the tools of the docs")
    neumann, contact = (name.lower() for name in named(coupling))
    controller, of_contact, of_neumann = yaml.safe_load_all(snippet("Norma", coupling))
    assert set(controller) == CONTROLLER | {"relaxation parameter"}
    assert controller["type"] == "multi"
    assert controller["domains"] == [f"{contact}.yaml", f"{neumann}.yaml"]
    assert controller["relaxation parameter"] == coupling.theta
    assert all(isinstance(controller[key], float) for key in ("relative tolerance", "absolute tolerance"))
    for body, partner in ((of_contact, neumann), (of_neumann, contact)):
        (condition,) = body["boundary conditions"]["Schwarz contact"]
        assert set(condition) == CONTACT
        assert condition["source"] == partner
        assert condition["friction type"] == ("tied" if coupling.tied else "frictionless")


@pytest.mark.parametrize("coupling", COUPLINGS, ids=str)
def test_every_snippet_fits_on_a_screen_of_80_columns(coupling):
    for library, method in product(SNIPPETS, METHODS):
        if library != "Norma" or method == "constant":
            assert max(map(len, snippet(library, coupling, method).splitlines())) <= 80


@pytest.mark.parametrize("tied", [False, True])
def test_advice_hands_on_its_own_role_and_theta(tied):
    found = vf.advise(vf.example("two-bars"), tied=tied)
    said = json.loads(found.snippet("Kratos"))["solver_settings"]["convergence_accelerators"][0]
    assert (said["alpha"], said["solver"]) == (found.theta, f"Body{found.neumann_body}")


def test_there_is_no_snippet_while_several_readings_are_left_or_for_another_library():
    with pytest.raises(ValueError, match="make the run"):
        vf.advise_run("0.1", "1.4").snippet("preCICE")
    with pytest.raises(ValueError, match="needed one of preCICE, Kratos, Norma"):
        vf.advise_run("0.45", "0.8").snippet("precise")


def test_a_method_that_does_not_exist_or_that_a_library_lacks_is_refused():
    with pytest.raises(ValueError, match="method 'atiken': needed one of constant, aitken, iqn-ils"):
        snippet("Kratos", COUPLINGS[0], "atiken")
    for method in ("aitken", "iqn-ils"):
        with pytest.raises(ValueError, match=f"Norma, method '{method}': needed 'constant'"):
            snippet("Norma", COUPLINGS[0], method)


def test_the_block_has_the_method_that_is_advised_where_the_library_has_it():
    S, X = np.diag(np.linspace(5.0, 200.0, 12)), np.random.default_rng(3).normal(size=(13, 12))
    stiff = vf.advise_vectors(X, 1 - X @ S)
    assert stiff.method is not None
    assert "<acceleration:IQN-ILS>" in stiff.snippet("preCICE")
    assert "<acceleration:constant>" in stiff.snippet("preCICE", "constant")
    assert '"iqnils"' in stiff.snippet("Kratos")
    assert f"relaxation parameter: {stiff.theta:g}" in stiff.snippet("Norma")
    soft = vf.advise_vectors(X, 1 - X @ S / 1e4)
    assert soft.method.name == "constant"
    assert "<acceleration:constant>" in soft.snippet("preCICE")
