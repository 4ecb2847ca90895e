"""garl: an archive of ways to fail, from which sparse scenarios are bred.

The first generation is plain random scenarios of the domain: the control, to which the rest of the
search is compared.  After it a bandit divides the flights between scenarios without parents, in
strata without NPCs, with careless ones and with those that know of the UAV, and children of the
archive's cells.  The first violation of a kind counts as a success and each further one less, so
that a new kind is worth more than one more of the same.

A generation is bred while the one before it is flown, and from the results of those before that:
no worker waits for the last flight of a generation.

A scenario that is flown like an earlier one is not flown again: its difference is a value that
does not count.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pytest_garl.scenarios.chromosome import decode, encode
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.archive import Archive
from pytest_garl.search.bandit import Bandit
from pytest_garl.search.breeding import WAYS, Breeding
from pytest_garl.search.columns import Columns
from pytest_garl.search.exploration import Exploration
from pytest_garl.search.method import FlownScenario, MethodDeclaration, SearchPlan
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.search.objectives import violation_proximity
from pytest_garl.search.operators import Matrix
from pytest_garl.search.seeding import seed_sequence

EXPLORE = "explore "
"""Begins the name of an arm without parents."""
ALL = "all"
"""The stratum of a genome without optional genes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GarlParameters:
    """All parameters of the search.

    ``python -m lab.ablations`` measures what each part of the search is worth.
    """

    explores_first: int = 100
    """So many scenarios are random or without parents before any is bred: a search finds more in
    conditions that did not act yet than near what it has found."""
    explore_share: float = 0.75
    """Least share of scenarios without parents after that, so that kinds are still found late."""
    learns_arms: bool = True
    """Whether cells and strata are chosen by their success; otherwise all alike."""
    has_strata: bool = True
    """Whether scenarios without parents are drawn in strata; otherwise as the domain draws them."""
    archive: Callable[[Columns], Archive] = Archive
    """What keeps the flights, and says which cells are bred from."""
    exploration: Callable[[Columns, Map], Exploration] = Exploration
    """What draws scenarios without parents."""


class Garl:
    """The archive of cells, and the breeding from it."""

    learns = True
    overlaps = True

    def __init__(self, plan: SearchPlan, parameters: GarlParameters | None = None) -> None:
        self._plan, self._parameters = plan, parameters or GarlParameters()
        self._rng = np.random.default_rng(seed_sequence("garl", plan.map.name, plan.seed))
        self._columns = Columns(plan.genome)
        self._archive = self._parameters.archive(self._columns)
        self._exploration = self._parameters.exploration(self._columns, plan.map)
        self._breeding = Breeding(self._columns, self._exploration)
        self._arms = Bandit()
        self._choices: dict[str, str] = {}
        """The arm of each scenario, by its text."""
        self._generation = 0
        self._flights_s: list[float] = []
        """How long each flight took, simulated."""
        self._unlearned: deque[Sequence[FlownScenario]] = deque()
        """Generations that were flown, and that the next one is not bred from yet."""

    def ask(self) -> Sequence[Scenario]:
        """Return the next generation; the first one is that of ``random``."""
        plan, self._generation = self._plan, self._generation + 1
        if self._generation > 1:
            if self._generation > 2:
                self._learn(self._unlearned.popleft())
            return [self._new() for _ in range(plan.population)]
        control = random_scenarios(plan.map, plan.genome, plan.seed, 0, plan.population)
        self._choices.update((dump_scenario(scenario), "") for scenario in control)
        return control

    def tell(self, flown: Sequence[FlownScenario]) -> Sequence[tuple[float, ...]]:
        """Keep the flights for the generation after the next; return proximities to a violation."""
        self._unlearned.append(flown)
        return [(violation_proximity(item.result),) for item in flown]

    def _learn(self, flown: Sequence[FlownScenario]) -> None:
        """Put each flight into its cells, and draw events into the time that flights take."""
        self._flights_s += [item.result.elapsed_s for item in flown]
        self._exploration.flight_s = float(np.median(self._flights_s))
        for item in flown:
            row = encode(item.scenario, self._plan.genome)
            success = self._archive.add(item, row)
            self._arms.learn(self._choices[dump_scenario(item.scenario)], success)

    def _new(self) -> Scenario:
        """Return a scenario that is flown unlike all earlier ones."""
        while True:
            arm, way = self._choose()
            if arm.startswith(EXPLORE):
                row, seed = self._explored(arm.removeprefix(EXPLORE)), self._new_seed()
            else:
                row, seed = self._child(arm, way)
            scenario = self._scenario(row, seed)
            if dump_scenario(scenario) not in self._choices:
                self._choices[dump_scenario(scenario)] = arm
                return scenario

    def _choose(self) -> tuple[str, str]:
        """Return an arm, and a way to breed for a cell."""
        strata = self._columns.strata if self._parameters.has_strata else ()
        explore = [f"{EXPLORE}{each}" for each in strata or (ALL,)]
        cells = self._archive.names()
        # A dense scenario has all conditions, so that there is nothing to explore first.
        is_early = self._columns.strata and len(self._choices) < self._parameters.explores_first
        if is_early or not cells or self._rng.random() < self._parameters.explore_share:
            return self._pick(explore), ""
        arm = self._pick([*explore, *cells])
        return arm, "" if arm in explore else str(self._rng.choice(WAYS))

    def _pick(self, names: Sequence[str]) -> str:
        if self._parameters.learns_arms:
            return self._arms.choose(names, self._rng)
        return str(self._rng.choice(names))

    def _explored(self, stratum: str) -> Matrix:
        if stratum == ALL:
            return self._plan.genome.random(self._rng)
        return self._exploration.new(stratum, self._rng)

    def _child(self, name: str, way: str) -> tuple[Matrix, int]:
        """Return a child of one of a cell's flights.

        The child inherits the scenario's seed: random moves are part of the parent's success.
        """
        parent = self._archive.parent(name, self._rng)
        donor = self._archive.parent(str(self._rng.choice(self._archive.names())), self._rng)
        body = parent.flown.result.closest_body
        row = self._breeding.child(way, parent.row, donor.row, body, self._rng)
        return row, parent.flown.scenario.seed

    def _new_seed(self) -> int:
        return int(self._rng.integers(2**32))

    def _scenario(self, row: Matrix, seed: int) -> Scenario:
        plan = self._plan
        return repair(decode(row, plan.genome, map=plan.map.name, seed=seed), plan.map)


METHOD = MethodDeclaration(make=Garl, policy="dqn")
