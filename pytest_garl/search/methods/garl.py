"""garl: scenarios evolve in a model of the landing system, and the most promising ones are flown.

The first generation is plain random scenarios of the domain: the control, to which the rest of the
search is compared.  What is left of the flights has two halves:

- first stratified scenarios, without parents (``search/exploration.py``), in strata without NPCs,
  with careless ones and with those that know of the UAV.  A bandit divides them among the strata.
  The first violation of a kind counts as a success and each further one less.  They bring the
  conditions into the search that the model learns of;
- then children, bred in a model that is fitted to the flights so far (``search/evolution.py``):
  whole conditions and NPCs of two flown scenarios.

Bred in turns with draws from the start on, children cost more than they found: after few flights
the model knows little.

The second generation waits for the control.  From then on a generation is bred while the one before
it is flown, from the results of those before that: no worker waits for the last flight of a
generation.

Flights of earlier searches that would fly alike are learned from like those of this one, after the
control is drawn.  Scenarios that failed elsewhere take places of stratified ones.

A scenario that is flown like an earlier one is not flown again: its difference is a value that
does not count.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pytest_garl.execution.flight_id import Slot
from pytest_garl.execution.result import Origin
from pytest_garl.scenarios.chromosome import decode, encode
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.bandit import Bandit
from pytest_garl.search.columns import Columns
from pytest_garl.search.exploration import Exploration
from pytest_garl.search.method import (
    FlownScenario,
    MethodDeclaration,
    SearchPlan,
    archived_name,
)
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.search.model import PROPERTIES, MarginModel, proximities
from pytest_garl.search.objectives import violation_proximity
from pytest_garl.search.operators import Matrix
from pytest_garl.search.seeding import seed_sequence

if TYPE_CHECKING:
    from pytest_garl.search.evolution import Chosen

ALL = "all"
"""The stratum of a genome without optional genes."""
FINDING_WORTH = 0.5
"""Success of the first flight in which something went wrong before its end: it is no violation
until a flight without NPCs shows it."""
FADING = 2
"""A violation of a kind that n flights showed is worth 1 / n to this power to the model: the second
of a kind says what else is near it, the tenth does not."""
ROUNDING = 1e-9
EXPECTED_DIGITS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class GarlParameters:
    """All parameters of the search.

    ``python -m lab.ablations`` measures what each part of the search is worth.
    """

    bred_share: float = 0.5
    """Share of the flights after the control that are children, the last ones; all before them are
    stratified."""
    replayed_share: float = 0.25
    """Largest share of a generation whose scenarios failed in another search."""
    shuffled: bool = False
    """Whether the model is fitted to results that are exchanged among the flights: a placebo, which
    has the same machinery and knows nothing."""


EXPLORING = GarlParameters(bred_share=0.0)
"""No children and no model."""


class Garl:
    """The search: its flights, and how its generations come about."""

    learns = True
    overlaps = True

    def __init__(self, plan: SearchPlan, parameters: GarlParameters | None = None) -> None:
        self._plan, self._parameters = plan, parameters or GarlParameters()
        seeds = seed_sequence("garl", plan.map.name, plan.seed)
        # Children draw from numbers of their own, so that without them the rest is drawn alike.
        self._rng, self._breeding_rng = (
            np.random.default_rng(each) for each in (seeds, seeds.spawn(1)[0])
        )
        self._columns = Columns(plan.genome)
        self._exploration = Exploration(self._columns, plan.map)
        self._strata = Bandit()
        self._choices: dict[str, str] = {}
        """The stratum of each scenario, by its text; empty for those that no stratum made."""
        self._seen: Counter[str] = Counter()
        """How many flights showed each kind of violation, or of finding."""
        self._generation = -1
        self._told: list[Sequence[FlownScenario]] = []
        self._learned = 0
        """How many generations were learned from."""
        self._flown: list[FlownScenario] = []
        """The flights of these generations, in order; ``_rows`` are their chromosomes."""
        self._rows: list[Matrix] = []
        self._suspects = deque(plan.suspects)
        self.origins: Sequence[Origin] = ()

    def ask(self) -> Sequence[Scenario]:
        """Return the next generation; the first one is that of ``random``."""
        plan, self._generation = self._plan, self._generation + 1
        if self._generation == 0:
            control = random_scenarios(plan.map, plan.genome, plan.seed, 0, plan.population)
            self._choices.update((dump_scenario(scenario), "") for scenario in control)
            self.origins = [Origin(how="control") for _ in control]
            return control
        if self._generation == 1:
            self._remember(plan.known)
        # Later results may be known already, which depends on who flies.
        wanted = max(1, self._generation - 1)
        for flown in self._told[self._learned : wanted]:
            self._learn(flown)
        self._learned = wanted
        children = deque(self._children(sum(map(self._is_bred, range(plan.population)))))
        replayed = deque(self._replayed())
        made = [
            children.popleft()
            if children and self._is_bred(place)
            else (replayed.popleft() if replayed else self._stratified())
            for place in range(plan.population)
        ]
        self.origins = [origin for _, origin in made]
        return [scenario for scenario, _ in made]

    def _is_bred(self, place: int) -> bool:
        """Whether a place in this generation is a child's: the last ones of the search are."""
        plan = self._plan
        bred = math.ceil(self._parameters.bred_share * (plan.flights - plan.population) - ROUNDING)
        number = self._generation * plan.population + place
        return plan.flights - bred <= number < plan.flights

    def tell(self, flown: Sequence[FlownScenario]) -> Sequence[tuple[float, ...]]:
        """Keep the flights for the generation after the next; return proximities to a violation."""
        self._told.append(flown)
        return [(violation_proximity(item.result),) for item in flown]

    def _remember(self, known: Sequence[FlownScenario]) -> None:
        """Learn from flights of earlier searches as from those of this one."""
        for item in known:
            text = dump_scenario(item.scenario)
            if text not in self._choices:
                self._choices[text] = self._stratum(encode(item.scenario, self._plan.genome))
        self._learn(known)

    def _replayed(self) -> Iterator[tuple[Scenario, Origin]]:
        """Yield the suspects of a generation, in place of stratified scenarios."""
        count = math.ceil(self._parameters.replayed_share * self._plan.population)
        while count and self._suspects:
            scenario = self._suspects.popleft()
            if self._is_new(scenario, self._stratum(encode(scenario, self._plan.genome))):
                yield scenario, Origin(how="replayed")
                count -= 1

    def _learn(self, flown: Sequence[FlownScenario]) -> None:
        """Learn which strata succeed, and draw events into the time that flights take."""
        if not flown:
            return
        self._flown += flown
        self._rows += [encode(item.scenario, self._plan.genome) for item in flown]
        self._exploration.flight_s = float(np.median([f.result.elapsed_s for f in self._flown]))
        for item in flown:
            self._strata.learn(self._choices[dump_scenario(item.scenario)], self._success(item))

    def _success(self, item: FlownScenario) -> float:
        """Return the success of a flight, 0 to 1: the n-th of a kind is worth 1 / n."""
        verdict = item.result.verdict
        shown = [(finding.signature, FINDING_WORTH) for finding in verdict.findings]
        if verdict.violation:
            shown.append((item.result.signature, 1.0))
        self._seen.update(signature for signature, _ in shown)
        return max((worth / self._seen[signature] for signature, worth in shown), default=0.0)

    def _children(self, count: int) -> Iterator[tuple[Scenario, Origin]]:
        """Yield ``count`` children; fewer if the flights have too few conditions to cross."""
        if count == 0:
            return
        # pymoo takes a third of a second to import.
        from pytest_garl.search.evolution import Choice, Evolution

        rng, rows = self._breeding_rng, np.array(self._rows)
        proximity = np.array([proximities(item.result) for item in self._flown])
        violates = np.array([float(item.result.verdict.violation) for item in self._flown])
        counts = np.array([max(1, self._seen[item.result.signature]) for item in self._flown])
        rarity = violates / counts**FADING
        if self._parameters.shuffled:
            order = rng.permutation(len(rows))
            proximity, violates, rarity = proximity[order], violates[order], rarity[order]
        model = MarginModel(self._columns, rows, proximity, violates, rarity)
        brood = Evolution(self._columns, self._exploration, model, rows, rng).candidates()
        if not len(brood):
            return
        choice = Choice(brood, model, (proximity >= 1).astype(float))
        of = np.array([self._stratum(row) for row in brood.rows])
        while count:
            stratum = self._strata.choose(self._arms, rng)
            child = choice.best(of == stratum) or choice.best(np.ones(len(of), dtype=bool))
            if child is None:
                return
            # Random moves are part of what the parent's NPC did.
            scenario = self._scenario(child.row, self._flown[child.base].scenario.seed)
            parents = self._parents(child, scenario)
            if len(parents) >= 2 and self._is_new(scenario, self._stratum(child.row)):
                yield scenario, self._origin(child, parents)
                count -= 1

    @property
    def _arms(self) -> Sequence[str]:
        """The strata among which flights are divided."""
        return self._columns.strata or (ALL,)

    def _stratum(self, row: Matrix) -> str:
        return self._columns.stratum(row) if self._arms != (ALL,) else ALL

    def _parents(self, child: Chosen, scenario: Scenario) -> list[int]:
        """Return the flights of which a child has a condition or an NPC with all of its values.

        Repairing a scenario may have moved a decoy or the marker.
        """
        row, slices = encode(scenario, self._plan.genome), self._columns.slices
        return sorted(
            {
                flight
                for gene, flight in child.sources.items()
                if np.array_equal(row[slices[gene]], self._rows[flight][slices[gene]])
            }
        )

    def _origin(self, child: Chosen, parents: Sequence[int]) -> Origin:
        """Return what the ledger says of a child."""
        return Origin(
            how="bred",
            parents=tuple(map(self._name, parents)),
            expected={
                name: round(value, EXPECTED_DIGITS)
                for name, value in zip(PROPERTIES, child.proximity, strict=True)
            },
            fails=round(child.fails, EXPECTED_DIGITS),
        )

    def _name(self, flight: int) -> str:
        """Return what the ledger calls a flight that was learned from."""
        own = flight - len(self._plan.known)
        if own < 0:
            return archived_name(flight)
        generation, index = divmod(own, self._plan.population)
        return Slot(generation=generation, index=index).id(self._plan.map.name)

    def _stratified(self) -> tuple[Scenario, Origin]:
        """Return a scenario without parents that is flown unlike all earlier ones."""
        while True:
            stratum = self._strata.choose(self._arms, self._rng)
            row = (
                self._plan.genome.random(self._rng)
                if stratum == ALL
                else self._exploration.new(stratum, self._rng)
            )
            scenario = self._scenario(row, int(self._rng.integers(2**32)))
            if self._is_new(scenario, stratum):
                return scenario, Origin(how="stratified")

    def _is_new(self, scenario: Scenario, stratum: str) -> bool:
        """Whether a scenario is new; from now on it is known."""
        text = dump_scenario(scenario)
        if text in self._choices:
            return False
        self._choices[text] = stratum
        return True

    def _scenario(self, row: Matrix, seed: int) -> Scenario:
        plan = self._plan
        return repair(decode(row, plan.genome, map=plan.map.name, seed=seed), plan.map)


METHOD = MethodDeclaration(make=Garl, policy="dqn", remembers=True)
