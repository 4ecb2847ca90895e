"""The interface of a search method: propose a generation, learn from its results."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from pytest_garl.execution.result import FlightResult, Origin
from pytest_garl.scenarios.genes import Genome
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.use_file import UseFile


@dataclass(frozen=True, slots=True, kw_only=True)
class FlownScenario:
    """A scenario with the result of its flight."""

    scenario: Scenario
    result: FlightResult


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchPlan:
    """The task of a search: its map, its genes, its seed, its flights and the size of a generation.

    ``known`` are flights of earlier searches that would fly alike today.  ``suspects`` are
    scenarios in which something failed that is not the same: another system, or this one before it
    was changed.  The first generation depends on neither.  ``use`` is what a user states of use.
    """

    map: Map
    genome: Genome
    seed: int
    flights: int
    population: int
    known: tuple[FlownScenario, ...] = ()
    suspects: tuple[Scenario, ...] = ()
    use: UseFile | None = None


def archived_name(number: int) -> str:
    """Return what the origins of children call a flight that ``SearchPlan.known`` holds."""
    return f"archived-{number}"


class Method(Protocol):
    """Breeds whole generations, so that the outcome does not depend on the workers.

    ``ask`` and ``tell`` alternate, or ``tell`` is one generation behind from the third generation
    on if the method overlaps: the second one always waits for the results of the first.
    The scenarios that ``ask`` returns depend only on the plan and on the results given to ``tell``.
    ``tell`` is never called on a method that does not learn.
    """

    @property
    def learns(self) -> bool:
        """Whether a generation depends on the results of earlier ones."""

    @property
    def overlaps(self) -> bool:
        """Whether a generation may be asked for before the one before it is told.

        It depends on the results of those before that, and no worker waits for the last flight.
        The second generation waits for the first all the same.
        """

    def ask(self) -> Sequence[Scenario]:
        """Return the next generation: ``population`` scenarios, all of them new."""

    def tell(self, flown: Sequence[FlownScenario]) -> Sequence[tuple[float, ...]]:
        """Learn from the generation; return each flight's objectives, for the ledger."""


@runtime_checkable
class TellsOrigins(Protocol):
    """A method that says how it made its scenarios, for the ledger."""

    @property
    def origins(self) -> Sequence[Origin]:
        """How the scenarios of the latest generation were made, in order."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodDeclaration:
    """The declaration of a shipped method: ``METHOD`` in its module of ``search/methods/``.

    ``make`` starts a search.  Packages that only this method needs are imported there.
    """

    make: Callable[[SearchPlan], Method]
    policy: str
    """The NPC policy that belongs to the method; ``--garl-npcs`` overrides it."""
    extra: str = ""
    """The extra of pytest-garl that holds packages which only this method needs."""
    remembers: bool = False
    """Whether it uses what an archive says of earlier searches."""
