"""The search methods' interface: propose a generation, learn from what it came to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.genes import Genome
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchPlan:
    """What a search is given: where, over which genes, from which seed, how many at a time."""

    map: Map
    genome: Genome
    seed: int
    population: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Flown:
    """A scenario with the result of its flight, as the ledger holds it."""

    scenario: Scenario
    result: FlightResult


class Method(Protocol):
    """Breeds whole generations, so that the outcome does not depend on the workers.

    ``ask`` and ``tell`` alternate.  What ``ask`` returns depends on the plan and on what
    was told alone.  A method that does not learn is never told.
    """

    @property
    def learns(self) -> bool:
        """Whether a generation depends on the results of the one before."""

    def ask(self) -> Sequence[Scenario]:
        """Return the next generation, ``population`` scenarios of which none came before."""

    def tell(self, flown: Sequence[Flown]) -> Sequence[tuple[float, ...]]:
        """Learn from the generation; return each flight's objectives, for the ledger."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodDeclaration:
    """What a module of ``search/methods/`` declares as ``METHOD``.

    ``make`` starts a search.  It may import what only this method needs.
    """

    make: Callable[[SearchPlan], Method]
    policy: str
    """The NPC policy that belongs to the method; ``--garl-npcs`` overrides it."""
    extra: str = ""
    """The extra of pytest-garl that the method needs."""
