"""garl: a search that looks for every way to fail.

MAP-Elites (Mouret and Clune 2015, "Illuminating search spaces by mapping elites") with the
paper's chromosomes and crossover.  A cell is a way to fail: a violation's signature, or that which
a near miss would have had.  Which cell is bred from is decided by Thompson sampling (Thompson
1933) of what its children came to: a first violation of a kind counts most, the twentieth little,
so that near misses of another kind are worth more than one more of the same.  The objects' places
and speeds are spread out as the paper's mutation does, away from all asked for before, which is to
the ends of their ranges; the marker, which decides where the UAV flies, is put where none has been
near.  Weather and light are not spread: at their ends a flight is aborted rather than failed.
"""

from __future__ import annotations

import hashlib
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.chromosome import decode, encode
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.method import Flown, MethodDeclaration, SearchPlan
from pytest_garl.search.objectives import violation_proximity
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

EXPLORES = 0.25
"""Share of scenarios that have no parents, so that cells are still found late in a search."""
AIMS = 0.5
"""Share of children that differ from a parent in the object that it came nearest to, by a small
step: what decides whether centimetres are missing."""
WEATHERS = 0.5
"""Share of these that also meet in another weather, that of a flight that was not aborted."""
PROGRESS = 0.01
"""A child that raises its cell's proximity to a violation by so much has succeeded."""
NEAREST = 0.1
"""The largest step shrinks with the distance to a violation, down to this share of it."""
SPREADS = 0.75
"""Share of places and speeds that are put away from all asked for before, in a scenario without
parents and in one bred far from its parent."""
MEMORY = 0.9
"""What a trial still counts for after one more of its arm: cells change as they are searched."""
NEAR, FAR = "near", "far"
"""Ways to breed: by small steps, or with all but the nearest object spread out."""

Genes = tuple[tuple[str, float], ...]
Arm = tuple[str, str]
"""What is chosen between: a cell and a way to breed from it."""
ORPHAN: Arm = ("", "")
"""What has no parents."""


class Garl:
    """The archive of cells, and how it is bred from.

    ``explores`` is the share of scenarios without parents, ``aims`` that of children bred near
    whose steps are aimed, ``weathers`` that of these in another weather, ``crossover`` the
    paper's probability for the others, ``spreads`` the share of genes that are spread out,
    ``cell`` names the cell of a flight's result; ``learns_cells`` is whether cells are chosen by
    their success instead of in turn.
    """

    learns = True

    def __init__(
        self,
        plan: SearchPlan,
        *,
        explores: float = EXPLORES,
        aims: float = AIMS,
        weathers: float = WEATHERS,
        learns_cells: bool = True,
        crossover: float = CROSSOVER_PROBABILITY,
        spreads: float = SPREADS,
        cell: Callable[[FlightResult], str] | None = None,
    ) -> None:
        self._plan, self._explores, self._aims = plan, explores, aims
        self._weathers, self._learns_cells = weathers, learns_cells
        self._crossover, self._spreads = crossover, spreads
        self._cell = cell or cell_of
        place = hashlib.sha256(f"garl {plan.map.name}".encode()).digest()
        key = int.from_bytes(place[:4], "big")
        self._rng = np.random.default_rng(np.random.SeedSequence(plan.seed, spawn_key=(key,)))
        self._cells: defaultdict[str, list[Flown]] = defaultdict(list)
        self._trials: defaultdict[Arm, tuple[float, float]] = defaultdict(lambda: (0.0, 0.0))
        self._arms: dict[Genes, Arm] = {}
        self._asked: list[Matrix] = []
        self._signatures: Counter[str] = Counter()
        keys = plan.genome.keys
        self._weather = np.array([key.startswith("environment.") for key in keys])
        self._marker = np.array([key.startswith("marker.") for key in keys])

    def ask(self) -> Sequence[Scenario]:
        """Return the next generation."""
        return [self._new() for _ in range(self._plan.population)]

    def tell(self, flown: Sequence[Flown]) -> Sequence[tuple[float, ...]]:
        """Put each flight into its cell; return its proximity to a violation."""
        for item in flown:
            name = self._cell(item.result)
            worth = self._worth(name, item)
            arm = self._arms[item.scenario.genes]
            wins, losses = self._trials[arm]
            self._trials[arm] = MEMORY * wins + worth, MEMORY * losses + 1 - worth
            self._cells[name].append(item)
        return [(violation_proximity(item.result),) for item in flown]

    def _worth(self, name: str, item: Flown) -> float:
        """Return how much of a success a flight is, 0 to 1."""
        signature = item.result.signature
        if signature:
            self._signatures[signature] += 1
            return float(self._signatures[signature] ** -0.5)
        best = max((violation_proximity(other.result) for other in self._cells[name]), default=-1.0)
        return float(violation_proximity(item.result) > best + PROGRESS)

    def _new(self) -> Scenario:
        """Return a scenario that was not asked for before."""
        while True:
            explores = not self._cells or self._rng.random() < self._explores
            arm = ORPHAN if explores else self._choose()
            scenario = self._random() if arm == ORPHAN else self._child(*arm)
            if scenario.genes not in self._arms:
                self._arms[scenario.genes] = arm
                self._asked.append(encode(scenario, self._plan.genome))
                return scenario

    def _choose(self) -> Arm:
        """Return the arm that looks most promising in a draw from what is known of each."""
        arms = [(name, NEAR) for name in sorted(self._cells)]
        # What is but nearly a violation hangs on all of its genes.
        arms += [(name, FAR) for name, _ in arms if name in self._signatures]
        if not self._learns_cells:
            bred = Counter(self._arms.values())
            return min(arms, key=lambda arm: bred[arm])
        trials = np.array([self._trials[arm] for arm in arms])
        return arms[int(np.argmax(self._rng.beta(1 + trials[:, 0], 1 + trials[:, 1])))]

    def _random(self) -> Scenario:
        row = self._spread(self._plan.genome.random(self._rng), ~self._weather)
        return self._scenario(row, int(self._rng.integers(2**32)))

    def _spread(self, row: Matrix, which: NDArray[np.bool_]) -> Matrix:
        """Return a copy, a share of whose genes among ``which`` is away from all asked for.

        One by one (paper, eq. 2); but for the marker, whose place is drawn as a whole.
        """
        rng, genome, spread = self._rng, self._plan.genome, row.copy()
        asked = np.array(self._asked) if self._asked else row[None]
        marker = self._marker
        for column in np.flatnonzero(which & ~marker & (rng.random(row.size) < self._spreads)):
            drawn = rng.uniform(genome.lower[column], genome.upper[column], CANDIDATES)
            spread[column] = drawn[farthest_from_all(drawn, asked[:, column])]
        if (which & marker).any() and rng.random() < self._spreads:
            shape = CANDIDATES, int(marker.sum())
            places = rng.uniform(genome.lower[marker], genome.upper[marker], shape)
            spread[marker] = places[farthest_from_nearest(places, asked[:, marker])]
        return spread

    def _child(self, name: str, way: str) -> Scenario:
        """Return a child of one of a cell's flights.

        A scenario's own seed is inherited with the tail of the chromosome, where the objects
        are: what they do by chance is part of what a parent was selected for.
        """
        rng, genome = self._rng, self._plan.genome
        first = self._elite(name)
        row, seed = encode(first.scenario, genome), first.scenario.seed
        # What nearly fails needs a small change, and so does what shall fail again.
        largest = LARGEST_STEP * max(NEAREST, 1 - violation_proximity(first.result))
        body = f"{first.result.closest_body}."
        aim = np.array([key.startswith(body) for key in genome.keys])
        if way == FAR:
            return self._scenario(self._spread(row, ~(aim | self._weather)), seed)
        if aim.any() and rng.random() < self._aims:
            moved = local_steps(
                row[None], genome.lower, genome.upper, rng, probability=1.0, largest=largest
            )[0]
            if rng.random() < self._weathers:
                row = np.where(self._weather, encode(self._in_other_weather(), genome), row)
            return self._scenario(np.where(aim, moved, row), seed)
        second = self._elite(str(rng.choice(sorted(self._cells)))).scenario
        pair = np.array([[*row, seed], [*encode(second, genome), second.seed]])
        crossed = nuclear_gene_crossover(pair, genome.borders, rng, self._crossover)[:1]
        moved = local_steps(crossed[:, :-1], genome.lower, genome.upper, rng, largest=largest)[0]
        return self._scenario(moved, int(crossed[0, -1]))

    def _in_other_weather(self) -> Scenario:
        """Return a flight that was not aborted, or any where all were."""
        every = [item for name in sorted(self._cells) for item in self._cells[name]]
        good = [item for item in every if item.result.outcome != "aborted"] or every
        return good[int(self._rng.integers(len(good)))].scenario

    def _elite(self, name: str) -> Flown:
        """Return one of a cell's flights that came nearest to a violation, or violated."""
        cell = self._cells[name]
        most = max(violation_proximity(item.result) for item in cell)
        elites = [item for item in cell if violation_proximity(item.result) == most]
        return elites[int(self._rng.integers(len(elites)))]

    def _scenario(self, row: Matrix, seed: int) -> Scenario:
        plan = self._plan
        return repair(decode(row, plan.genome, map=plan.map.name, seed=seed), plan.map)


def cell_of(result: FlightResult) -> str:
    """Return how a flight failed or nearly did: a signature, or the outcome."""
    return result.signature or result.closest_call or result.outcome


METHOD = MethodDeclaration(make=Garl, policy="dqn")
