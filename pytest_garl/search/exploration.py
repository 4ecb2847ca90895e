"""Draws scenarios that have no parents.

Only a few optional genes act in each, so that one can see the effect of each gene.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.search.columns import CARELESS, NOBODY, Columns, OptionalGene
from pytest_garl.search.operators import Matrix

LONE_NPC_SHARE = 0.8
"""Of scenarios with NPCs, this share has one: one says more than two, and severity counts it."""
SLACK = 2.0
"""Times that a gene may have acted more often than another and still be chosen before it, so that
which genes act together is random."""
EVENT_PAIR_SHARE = 1 / 3
"""Share of scenarios that have two events, if there is room: how a system handles one of them shows
when another comes.  Most failures of distributed systems take two or three events, few take more
(Yuan et al., Simple Testing Can Prevent Most Critical Failures, OSDI 2014)."""
COINCIDENT_SHARE = 0.5
"""Share of the events beside an earlier one that begin while the earlier one lasts."""
AFTER_MOMENT_S = 5.0
"""An event that waits for a moment of the landing begins at most this long after it: each moment is
followed by the next one within seconds (a descent from 8 m to 3 m takes some 5 s)."""


class Exploration:
    """Draws scenarios without parents.

    An event is drawn into the time that a flight takes.  ``flight_s`` is the time of those flown so
    far; infinite before the first.
    """

    draws = 8
    """How many values are drawn for a condition; the most extreme one is flown.  For a decoy it is
    the one nearest to the UAV's way."""

    def __init__(self, columns: Columns, map: Map) -> None:
        self._columns, self._map = columns, map
        self.flight_s = float("inf")
        self._times: Counter[str] = Counter()
        """How often each gene was chosen to act."""
        self._event_pairs: Counter[tuple[str, str]] = Counter()
        """How often two events were chosen to act together."""

    def new(self, stratum: str, rng: np.random.Generator) -> Matrix:
        """Return a chromosome of a stratum."""
        columns = self._columns
        row = columns.genome.random(rng)
        if not columns.optional:
            return row
        names = self.names(stratum, rng)
        row = columns.with_active(row, names)
        active = [gene for gene in columns.optional if gene.name in names]
        for gene in active:
            row[gene.values] = self.values(gene, row, rng)
            column = gene.grade_column
            if gene.is_npc and column >= 0:
                low, high = (0.0, 1.0) if stratum == CARELESS else (1.0, columns.upper[column])
                top = np.nextafter(min(high, columns.upper[column]), low)
                row[column] = rng.uniform(low, top) if top > low else low
        self.let_coincide(row, active, rng)
        return row

    def values(self, gene: OptionalGene, row: Matrix, rng: np.random.Generator) -> Matrix:
        """Return values with which a gene acts in a chromosome; those of a condition show most."""
        draws = 1 if gene.is_npc else self.draws
        genome = self._columns.genome
        drawn = [genome.random_active(rng, (gene.name,))[gene.values] for _ in range(draws)]
        return self.while_flying(gene, self.choose(gene, row, drawn))

    def drawn(
        self, row: Matrix, rng: np.random.Generator, count: int
    ) -> Mapping[str, Sequence[Matrix]]:
        """Return ``count`` values of each optional gene, drawn as ``values`` draws them."""
        columns, names = self._columns, [gene.name for gene in self._columns.optional]
        found: dict[str, list[Matrix]] = {name: [] for name in names}
        for _ in range(count if names else 0):
            rows = [columns.genome.random_active(rng, names) for _ in range(self.draws)]
            for gene in columns.optional:
                drawn = [each[gene.values] for each in rows[: 1 if gene.is_npc else None]]
                found[gene.name].append(self.while_flying(gene, self.choose(gene, row, drawn)))
        return found

    def choose(self, gene: OptionalGene, row: Matrix, drawn: Sequence[Matrix]) -> Matrix:
        """Return the values that show most: a decoy near the UAV's way, others far from nominal."""
        if gene.place_column >= 0:
            return self.nearest_to_way(gene, row, drawn)
        return max(drawn, key=lambda values: self._columns.harshness(values, gene))

    def names(self, stratum: str, rng: np.random.Generator) -> tuple[str, ...]:
        """Return a set of genes of a stratum, as many as may act, of those that acted least."""
        columns = self._columns
        npcs = [gene.name for gene in columns.optional if gene.is_npc]
        others = [gene.name for gene in columns.optional if not gene.is_npc]
        size = min(columns.limit, len(others) + len(npcs) * (stratum != NOBODY))
        count = 0
        if stratum != NOBODY:
            count = 1 if rng.random() < LONE_NPC_SHARE else min(2, len(npcs), size)
        left = min(size - count, len(others))
        pair = self.pair_of_events(rng) if left >= 2 else ()
        others = [name for name in others if name not in pair]
        rest = self.least_flown(others, left - len(pair), rng)
        return (*self.least_flown(npcs, count, rng), *pair, *rest)

    def pair_of_events(self, rng: np.random.Generator) -> Sequence[str]:
        """Return two events that acted together least often so far, or none.

        A pair does not count for ``least_flown``, so that events act without another one as well.
        """
        events = [gene.name for gene in self._columns.optional if gene.begins_column >= 0]
        if len(events) < 2 or rng.random() >= EVENT_PAIR_SHARE:
            return ()
        pairs = itertools.combinations(events, 2)
        pair = min(pairs, key=lambda each: self._event_pairs[each] + rng.random())
        self._event_pairs[pair] += 1
        return pair

    def least_flown(
        self, names: Sequence[str], count: int, rng: np.random.Generator
    ) -> Sequence[str]:
        """Return the genes that acted least often so far, up to a random number of times."""
        order = sorted(names, key=lambda name: self._times[name] + SLACK * rng.random())
        self._times.update(order[:count])
        return order[:count]

    def while_flying(self, gene: OptionalGene, values: Matrix) -> Matrix:
        """Return values whose event begins before a flight ends, or soon after its moment."""
        if gene.begins_column < 0:
            return values
        first = gene.values.start
        # The start of the flight is moment 0.
        waits = gene.after_column >= 0 and round(float(values[gene.after_column - first])) > 0
        latest_s = min(self.flight_s, AFTER_MOMENT_S) if waits else self.flight_s
        low, high = self._columns.lower[gene.begins_column], self._columns.upper[gene.begins_column]
        share = min(1.0, max(0.0, latest_s - low) / (high - low))
        moved, index = values.copy(), gene.begins_column - first
        moved[index] = low + share * (values[index] - low)
        return moved

    def let_coincide(
        self, row: Matrix, active: Sequence[OptionalGene], rng: np.random.Generator
    ) -> None:
        """Let some events begin while another lasts, in place: what they do together shows then."""
        events = [gene for gene in active if gene.begins_column >= 0]
        for first, second in itertools.pairwise(events):
            if rng.random() >= COINCIDENT_SHARE:
                continue
            begin = row[first.begins_column] - self._lasts(second, row)
            end = row[first.begins_column] + self._lasts(first, row)
            if min(first.after_column, second.after_column) >= 0:
                row[second.after_column] = row[first.after_column]
            column = second.begins_column
            low, high = self._columns.lower[column], self._columns.upper[column]
            row[column] = np.clip(rng.uniform(begin, end), low, high)

    def _lasts(self, gene: OptionalGene, row: Matrix) -> float:
        return float(row[gene.lasts_column]) if gene.lasts_column >= 0 else 0.0

    def nearest_to_way(self, gene: OptionalGene, row: Matrix, drawn: Sequence[Matrix]) -> Matrix:
        """Return the decoy that lies nearest to the way to the coordinate that the UAV is told."""
        scenario = decode(row, self._columns.genome, map=self._map.name, seed=0)
        start, middle = np.array(self._map.uav_start_m[:2]), np.array(self._map.gps_position_m)
        way = np.array(Placed(scenario, self._map).told_m) - start
        first = gene.place_column - gene.values.start

        def off_way_m(values: Matrix) -> float:
            place = middle + values[first : first + 2] - start
            along = np.clip(np.dot(place, way) / max(1e-9, np.dot(way, way)), 0, 1)
            return float(np.linalg.norm(place - along * way))

        return min(drawn, key=off_way_m)
