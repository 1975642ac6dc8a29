"""A structural model of Kratos whose interface may open: CoSimulation loads it for a contact body without friction."""

import KratosMultiphysics as KM
from KratosMultiphysics.CoSimulationApplication.solver_wrappers.kratos import structural_mechanics_wrapper

#: Patterns of closed nodes that are tried; the ones of the tests take six.
MOST = 50


def Create(settings, model, solver_name):
    """The solver, as CoSimulation asks for it."""
    return UnilateralWrapper(settings, model, solver_name)


class UnilateralWrapper(structural_mechanics_wrapper.StructuralMechanicsWrapper):
    """Step II without friction: an obstacle along x moves by the displacement that was read, and does not pull.

    Kratos solves the linear system of each pattern of closed nodes; a pattern is kept where no closed node is pulled
    and no open one penetrates.
    """

    def Initialize(self):
        super().Initialize()
        self.nodes = list(self.model["Structure.Interface"].Nodes)
        heights = [node.Y for node in self.model["Structure"].Nodes]
        self.side = 1 if sum(heights) / len(heights) > self.nodes[0].Y else -1  # 1: the body lies above
        self.closed = [True] * len(self.nodes)

    def SolveSolutionStep(self):
        obstacle = [node.GetSolutionStepValue(KM.DISPLACEMENT_Y) for node in self.nodes]
        for _ in range(MOST):
            hold(self.nodes, obstacle, self.closed)
            super().SolveSolutionStep()
            given = zip(self.nodes, obstacle, self.closed, strict=True)
            before, self.closed = self.closed, [stays(*each, self.side) for each in given]
            if self.closed == before:
                break
        else:
            raise RuntimeError(f"no pattern of closed nodes among {MOST}")
        for node, closed in zip(self.nodes, self.closed, strict=True):  # of a free component Kratos keeps an old one
            node.SetSolutionStepValue(KM.REACTION_X, 0.0)
            if not closed:
                node.SetSolutionStepValue(KM.REACTION_Y, 0.0)


def hold(nodes, obstacle, pattern):
    """Hold the closed nodes on the obstacle, and free all else."""
    for node, height, closed in zip(nodes, obstacle, pattern, strict=True):
        node.Free(KM.DISPLACEMENT_X)
        if closed:
            node.Fix(KM.DISPLACEMENT_Y)
            node.SetSolutionStepValue(KM.DISPLACEMENT_Y, height)
        else:
            node.Free(KM.DISPLACEMENT_Y)


def stays(node, height, closed, side):
    """True if a node is closed in the next pattern."""
    if closed:
        return side * node.GetSolutionStepValue(KM.REACTION_Y) >= 0
    return side * (node.GetSolutionStepValue(KM.DISPLACEMENT_Y) - height) < 0
