"""garl: an archive of ways to fail, from which scenarios are bred.

MAP-Elites (Mouret and Clune 2015, "Illuminating search spaces by mapping elites") with the paper's
chromosomes and crossover.  A cell of the archive is a way to fail: the signature of a violation;
the signature of what had gone wrong before it; the body or the property that a near miss came
nearest to; the cause of a flight without landing that is excused.  A flight lies in all of its
cells.  Thompson sampling (Thompson 1933) chooses the cell to breed from by the results of its
children.  The first violation of a kind counts most and the twentieth little, so that near misses
of another kind are worth more than one more of the same.  Nothing is bred from a flight in which
nobody could have seen the marker.

Places and speeds of NPCs are spread out as in the paper's mutation: away from all earlier ones,
which means to the ends of their ranges.  The marker decides where the UAV flies, and is put far
from its nearest earlier place.  Weather and light are not spread, because at the ends of their
ranges a flight is aborted rather than failed.

In a sparse genome only the values of what acts are spread, away from the earlier scenarios in which
it acted.  Which groups act is drawn or inherited: bits that are spread would all be on.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.chromosome import decode, encode
from pytest_garl.scenarios.genes import ACTIVE, Genome
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.sparse import ON_ABOVE
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.method import FlownScenario, MethodDeclaration, SearchPlan
from pytest_garl.search.objectives import BODIES, near_miss, violation_proximity
from pytest_garl.search.operators import (
    CANDIDATES,
    CROSSOVER_PROBABILITY,
    LARGEST_STEP,
    Matrix,
    farthest_from_all,
    farthest_from_nearest,
    local_steps,
    nuclear_gene_crossover,
)
from pytest_garl.search.seeding import seed_sequence

NEAR, FAR = "near", "far"
"""Ways to breed: by small steps, or with everything but the nearest NPC spread out."""

Genes = tuple[tuple[str, float], ...]
Arm = tuple[str, str]
"""A choice of the bandit: a cell and a way to breed from it."""
NO_PARENT: Arm = ("", "")
"""The arm of scenarios that are drawn at random."""


EXCUSED, INCONCLUSIVE = "excused", "inconclusive"
BARREN = frozenset({EXCUSED, INCONCLUSIVE})
"""Cells that are not bred from: of flights that say nothing about the landing system."""
FINDING_WORTH = 0.5
"""Success of the first flight in which something went wrong before its end; it is no violation
until a flight without NPCs shows it."""


def cell_of(result: FlightResult) -> str:
    """Return how a flight failed or nearly failed.

    That is the signature of a violation, the cause of a flight without landing that violates
    nothing, the signature of a collision with the nearest body, the property that was nearly
    violated, or the outcome.
    """
    verdict = result.verdict
    if verdict.violation or verdict.no_landing:
        return verdict.signature or verdict.no_landing
    name, _ = near_miss(result)
    if not name or name in BODIES:
        return result.closest_call or result.outcome
    return f"near {name}"


def cells_of(result: FlightResult) -> tuple[str, ...]:
    """Return the cells of a flight: how it failed, and what had gone wrong before."""
    return (cell_of(result), *(finding.signature for finding in result.verdict.findings))


@dataclass(frozen=True, slots=True, kw_only=True)
class GarlParameters:
    """All parameters of the search.

    ``python -m studies.ablations`` measures what each part of the search is worth.
    """

    explore_share: float = 0.25
    """Share of scenarios without parents, so that cells are still found late in a search."""
    aimed_share: float = 0.5
    """Share of children bred near whose small steps change only the NPC that their parent came
    nearest to, because the last centimetres depend on that NPC."""
    other_weather_share: float = 0.5
    """Share of aimed children that also get the weather of another flight that did not end without
    a landing."""
    crossover_probability: float = CROSSOVER_PROBABILITY
    """The paper's probability, for children bred near that are not aimed."""
    spread_share: float = 0.75
    """Share of places and speeds that are put away from all earlier ones, in a scenario without
    parents and in one bred far from its parent."""
    least_progress: float = 0.01
    """A child succeeds if it raises its cell's proximity to a violation by this much."""
    least_step_share: float = 0.1
    """The largest step shrinks with the distance to a violation, down to this share of it."""
    trial_weight: float = 0.9
    """Weight of an arm's trials after one more trial, because cells change as they are searched."""
    learns_cells: bool = True
    """Whether cells are chosen by their success; otherwise each in turn."""
    cells: Callable[[FlightResult], tuple[str, ...]] = cells_of
    """The names of a flight's cells, from the flight's result."""


class Garl:
    """The archive of cells, and the breeding from it."""

    learns = True

    def __init__(self, plan: SearchPlan, parameters: GarlParameters | None = None) -> None:
        self._plan, self._parameters = plan, parameters or GarlParameters()
        self._rng = np.random.default_rng(seed_sequence("garl", plan.map.name, plan.seed))
        self._cells: defaultdict[str, list[FlownScenario]] = defaultdict(list)
        self._trials: defaultdict[Arm, tuple[float, float]] = defaultdict(lambda: (0.0, 0.0))
        self._arms: dict[Genes, Arm] = {}
        self._chromosomes: list[Matrix] = []
        self._seen: Counter[str] = Counter()
        keys = plan.genome.keys
        self._weather = _weather(plan.genome)
        self._marker = np.array([key.startswith("marker.") for key in keys])
        self._is_bit = np.array([key.startswith(ACTIVE) for key in keys])
        self._bit_of = _bits(plan.genome)

    def ask(self) -> Sequence[Scenario]:
        """Return the next generation."""
        return [self._new() for _ in range(self._plan.population)]

    def tell(self, flown: Sequence[FlownScenario]) -> Sequence[tuple[float, ...]]:
        """Put each flight into its cells; return its proximity to a violation."""
        weight = self._parameters.trial_weight
        for item in flown:
            names = self._parameters.cells(item.result)
            success = self._success(names[0], item)
            arm = self._arms[item.scenario.genes]
            wins, losses = self._trials[arm]
            self._trials[arm] = weight * wins + success, weight * losses + 1 - success
            for name in names:
                self._cells[name].append(item)
        return [(violation_proximity(item.result),) for item in flown]

    def _success(self, name: str, item: FlownScenario) -> float:
        """Return the success of a flight, 0 to 1: that of the best thing which it shows."""
        verdict = item.result.verdict
        shown = [(finding.signature, FINDING_WORTH) for finding in verdict.findings]
        if verdict.violation:
            shown.append((verdict.signature, 1.0))
        self._seen.update(signature for signature, _ in shown)
        worths = [worth * self._seen[signature] ** -0.5 for signature, worth in shown]
        if not verdict.violation and name not in BARREN:
            near = violation_proximity(item.result)
            cell = self._cells.get(name, [])
            best = max((violation_proximity(other.result) for other in cell), default=-1.0)
            worths.append(float(near > best + self._parameters.least_progress))
        return max(worths, default=0.0)

    def _new(self) -> Scenario:
        """Return a scenario that differs from all earlier ones."""
        while True:
            explores = not self._fertile() or self._rng.random() < self._parameters.explore_share
            arm = NO_PARENT if explores else self._choose()
            scenario = self._random() if arm == NO_PARENT else self._child(*arm)
            if scenario.genes not in self._arms:
                self._arms[scenario.genes] = arm
                self._chromosomes.append(encode(scenario, self._plan.genome))
                return scenario

    def _fertile(self) -> list[str]:
        """Return the cells that are bred from."""
        return sorted(name for name in self._cells if name not in BARREN)

    def _choose(self) -> Arm:
        """Return the arm with the best draw from the distribution of its success."""
        arms = [(name, NEAR) for name in self._fertile()]
        # A near miss depends on all of its genes, so only violations are bred far.
        arms += [
            (name, FAR)
            for name, _ in arms
            if name and self._cells[name][0].result.signature == name
        ]
        if not self._parameters.learns_cells:
            bred = Counter(self._arms.values())
            return min(arms, key=lambda arm: bred[arm])
        trials = np.array([self._trials[arm] for arm in arms])
        return arms[int(np.argmax(self._rng.beta(1 + trials[:, 0], 1 + trials[:, 1])))]

    def _random(self) -> Scenario:
        row = self._spread(self._plan.genome.random(self._rng), ~self._weather)
        return self._scenario(row, int(self._rng.integers(2**32)))

    def _spread(self, row: Matrix, which: NDArray[np.bool_]) -> Matrix:
        """Return a copy in which a share of the genes ``which`` is away from all earlier values.

        Genes are drawn one by one (paper, eq. 2), except the marker's place, a point.
        """
        rng, genome, spread = self._rng, self._plan.genome, row.copy()
        earlier = np.array(self._chromosomes) if self._chromosomes else row[None]
        marker, share = self._marker, self._parameters.spread_share
        which = which & ~self._is_bit
        for column in np.flatnonzero(which & ~marker & (rng.random(row.size) < share)):
            bit = self._bit_of[column]
            values = earlier[:, column] if bit < 0 else earlier[earlier[:, bit] > ON_ABOVE, column]
            if not values.size:
                continue  # The first scenario in which it acts.
            drawn = rng.uniform(genome.lower[column], genome.upper[column], CANDIDATES)
            spread[column] = drawn[farthest_from_all(drawn, values)]
        if (which & marker).any() and rng.random() < share:
            shape = CANDIDATES, int(marker.sum())
            places = rng.uniform(genome.lower[marker], genome.upper[marker], shape)
            spread[marker] = places[farthest_from_nearest(places, earlier[:, marker])]
        return spread

    def _child(self, name: str, way: str) -> Scenario:
        """Return a child of one of a cell's flights.

        The child inherits the scenario's seed with the tail of the chromosome, which holds the
        NPCs: their random moves are part of the parent's success.
        """
        rng, genome = self._rng, self._plan.genome
        first = self._elite(name)
        row, seed = encode(first.scenario, genome), first.scenario.seed
        # A near miss needs a small change, and a violation keeps failing only after a small one.
        largest = LARGEST_STEP * max(
            self._parameters.least_step_share, 1 - violation_proximity(first.result)
        )
        body = f"{first.result.closest_body}." if _is_about_a_body(first.result) else "no body."
        aim = np.array([key.startswith(body) for key in genome.keys])
        if way == FAR:
            return self._scenario(self._spread(row, ~(aim | self._weather)), seed)
        if aim.any() and rng.random() < self._parameters.aimed_share:
            moved = local_steps(
                row[None], genome.lower, genome.upper, rng, probability=1.0, largest=largest
            )[0]
            if rng.random() < self._parameters.other_weather_share:
                row = np.where(self._weather, encode(self._in_other_weather(), genome), row)
            bits = self._bit_of[aim]
            row[bits[bits >= 0]] = 1.0  # Of all that would act, this one does.
            return self._scenario(np.where(aim, moved, row), seed)
        second = self._elite(str(rng.choice(self._fertile()))).scenario
        pair = np.array([[*row, seed], [*encode(second, genome), second.seed]])
        probability = self._parameters.crossover_probability
        crossed = nuclear_gene_crossover(pair, genome.borders, rng, probability)[:1]
        moved = local_steps(crossed[:, :-1], genome.lower, genome.upper, rng, largest=largest)[0]
        return self._scenario(moved, int(crossed[0, -1]))

    def _in_other_weather(self) -> Scenario:
        """Return a scenario whose flight did not end without a landing, or any if all did."""
        every = [item for name in sorted(self._cells) for item in self._cells[name]]
        good = [item for item in every if not item.result.verdict.no_landing] or every
        return good[int(self._rng.integers(len(good)))].scenario

    def _elite(self, name: str) -> FlownScenario:
        """Return one of a cell's flights with the highest proximity to a violation."""
        cell = self._cells[name]
        most = max(violation_proximity(item.result) for item in cell)
        elites = [item for item in cell if violation_proximity(item.result) == most]
        return elites[int(self._rng.integers(len(elites)))]

    def _scenario(self, row: Matrix, seed: int) -> Scenario:
        plan = self._plan
        return repair(decode(row, plan.genome, map=plan.map.name, seed=seed), plan.map)


def _weather(genome: Genome) -> NDArray[np.bool_]:
    """Return which columns belong to genes of weather and light, their bits among them."""
    return np.array(
        [
            any(item.key.startswith("environment.") for item in gene.properties)
            for gene in genome.genes
            for _ in gene.properties
        ]
    )


def _bits(genome: Genome) -> NDArray[np.int_]:
    """Return for each column that of its gene's bit of activity, -1 for a gene without one."""
    columns: list[int] = []
    for gene in genome.genes:
        bit = len(columns) if gene.is_optional else -1
        columns += [bit] * len(gene.properties)
    return np.array(columns)


def _is_about_a_body(result: FlightResult) -> bool:
    """Whether a flight hit a body, or came nearer to that than to any other violation."""
    if result.verdict.violation:
        return result.verdict.primary == "collision"
    return near_miss(result)[0] in BODIES


METHOD = MethodDeclaration(make=Garl, policy="dqn")
