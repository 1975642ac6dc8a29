"""Two layers without ends in place of the bodies of a problem file: a prediction in a norm that the proof chooses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from ndtheory import HypothesisError, Number
from ndtheory.continuum.circle import TwoLayers
from ndtheory.keys import Part, key
from verification.certificate.continuum import two_rectangles
from verification.coupling.kinds import BodyNumber
from verification.coupling.roles import Role
from verification.free_norm.search import Search, comparable
from verification.problem import Problem, ProblemError


@dataclass(frozen=True, kw_only=True)
class RoleOfLayers(Part):
    """Two layers as deep as the bodies, in one role; ``reason`` says why a value is None."""

    neumann_body: BodyNumber = key("who has the Neumann problem in these roles", type="integer")
    theta: float = key(r"the `theta_predicted` of these roles", unit="1")
    factor: Number | None = key(
        "by which a step contracts there in a norm that the proof chooses", unit="1", default=None,
        null="where no norm is found in which it contracts",
    )  # fmt: skip
    friction_threshold: Number = key("friction below which every small theta contracts in such a norm", unit="1")
    reason: dict[str, str] = field(default_factory=dict)


def of_layers(problem: Problem, friction: float, roles: Iterable[Role]) -> Iterator[RoleOfLayers]:
    """The layers of a problem whose bodies are rectangles held at their outer sides, in each of some roles.

    None without friction, where nothing is gained over the prediction, and none of other bodies, or of such that differ
    too much in stiffness or in size for doubles.
    """
    if not friction:
        return
    try:
        bodies = two_rectangles(problem)
        strips = {"contact": bodies.contact.strip, "neumann": bodies.neumann.strip}
        layers = comparable(TwoLayers(**strips, radius=bodies.radius))
    except (ProblemError, HypothesisError):
        return
    for role in roles:
        if role.theta_predicted is None or role.neumann_body is None:  # refused
            continue
        own = role.neumann_body == problem.iteration.neumann_body
        search = Search(layers if own else layers.swapped)
        factor = search.factor(role.theta_predicted, friction)
        yield RoleOfLayers(
            neumann_body=role.neumann_body,
            theta=role.theta_predicted,
            factor=None if factor is None else Number.of_float(factor),
            friction_threshold=Number.of_float(search.friction_threshold),
            reason={} if factor is not None else {"factor": "no norm was found in which a step contracts there"},
        )
