"""The convergence accelerator for Kratos, called as CoSimulation calls it; Kratos itself is in test_kratos."""

import importlib
import json
import sys
from types import ModuleType, SimpleNamespace

import coupling_logs
import numpy as np
import pytest

from verification.coupling.driver import Coupling
from verification.coupling.kratos import LABEL, Accelerator, Create

MODES = np.array(coupling_logs.MODES)


def time_step(accelerator, steps, solution=1.0):
    """Iterates of a coupling with these modes, as ConvergenceAcceleratorWrapper makes them."""
    g, found = np.zeros(len(MODES)), []
    accelerator.InitializeSolutionStep()
    for _ in range(steps):
        accelerator.InitializeNonLinearIteration()
        found.append(g)
        residual = (1 + MODES) * (solution - g)
        accelerator.FinalizeNonLinearIteration()
        g = g + accelerator.UpdateSolution(residual, g)
    accelerator.FinalizeSolutionStep()
    return np.array(found)


@pytest.mark.parametrize("rule", ["constant", "aitken", "anderson", "iqn-ils"])
def test_it_relaxes_as_a_coupling_does(rule):
    found = time_step(Accelerator({"rule": rule, "theta": 0.3}, print), 4)
    coupling, g = Coupling(rule=rule, theta=0.3), np.zeros(len(MODES))
    for iterate in found:
        assert iterate == pytest.approx(g, abs=1e-12)
        g = coupling.next(g, 1 - MODES * (g - 1))


def test_each_time_step_begins_anew():
    one = Accelerator({"rule": "iqn-ils", "theta": 0.3}, print)
    first = time_step(one, 5)
    assert time_step(one, 5) == pytest.approx(first, abs=1e-12)
    assert time_step(one, 5, solution=2.0) == pytest.approx(2 * first, abs=1e-12)


def test_at_the_end_it_prints_the_advice_of_the_longest_time_step():
    said = []
    one = Accelerator({"rule": "iqn-ils", "theta": 0.3, "echo_level": 1}, said.append)
    time_step(one, 2)
    time_step(one, 5)
    time_step(one, 1)
    one.Finalize()
    (text,) = said
    assert "5 iterates of 4 unknowns" in text
    assert "largest lambda, rho  3.00 " in text


@pytest.mark.parametrize(("echo_level", "said"), [(0, []), (1, ["No advice: 1 vectors show no eigenvalue"])])
def test_without_two_vectors_it_has_no_advice_and_at_level_0_it_is_silent(echo_level, said):
    heard = []
    one = Accelerator({"echo_level": echo_level}, heard.append)
    one.Finalize()
    assert heard == []
    time_step(one, 1)
    one.Finalize()
    assert heard == said


@pytest.mark.parametrize(
    ("settings", "fragment"),
    [
        ({"alpha": 0.5}, "'alpha' is not a setting, needed rule or theta"),
        ({"theta": 0}, "0 < theta <= 1"),
        ({"rule": "newton"}, "needs both bodies"),
        ({"rule": "iqnils"}, "iqn-ils"),
    ],
)
def test_settings_that_it_does_not_have_are_refused(settings, fragment):
    with pytest.raises(ValueError, match=fragment):
        Accelerator(settings, print)


def test_kratos_creates_it_from_its_parameters_and_it_prints_by_the_logger_of_kratos(monkeypatch):
    said = []
    kratos = ModuleType("KratosMultiphysics")
    kratos.Logger = SimpleNamespace(PrintInfo=lambda *words: said.append(words))
    monkeypatch.setitem(sys.modules, "KratosMultiphysics", kratos)
    settings = {"type": "verification.coupling.kratos", "rule": "aitken", "theta": 0.5, "echo_level": 4}
    one = Create(SimpleNamespace(WriteJsonString=lambda: json.dumps(settings)))
    one.Initialize()
    one.Check()
    one.PrintInfo()
    time_step(one, 1)
    assert said == [(LABEL, "rule aitken, theta 0.5"), (LABEL, "Relaxing by the rule aitken")]
    assert not one.SupportsDistributedData()


def test_the_module_is_imported_without_kratos(monkeypatch):
    monkeypatch.setitem(sys.modules, "KratosMultiphysics", None)
    monkeypatch.delitem(sys.modules, "verification.coupling.kratos")
    assert importlib.import_module("verification.coupling.kratos").LABEL == LABEL
