"""Evolution of scenarios in the model of a landing system: NSGA-II over rows of an array.

A search of 400 flights is too short to evolve in: NSGA-II needs thousands of evaluations, and a
flight costs a second.  So a generation of flights is bred in these steps:

1. *Fit.*  ``model.py`` is fitted to all flights so far: how near each came to violating each
   property, and how rare the kind of its violation is.  It costs some 0.1 s for 400 flights.
2. *Start.*  The flown scenarios are the first population; nothing is drawn.
3. *Evolve.*  Two parents are chosen by tournament of rank and crowding, as in NSGA-II (Deb et al.
   2002; pymoo's survival).  A child has whole conditions and NPCs of two *flown* scenarios: nuclear
   genes, which the paper's crossover never divides.  The mutation adds a gene that neither parent
   has, an NPC or a condition, with values drawn as ``exploration.py`` draws them.  Each of
   ``GENERATIONS`` generations has ``POPULATION`` children, and these 480 candidates cost 0.1 s.
   Their objectives are the proximity of each property that the model thinks possible, the rarity
   of the kind that it expects, and how unlike what was flown a candidate is.
4. *Choose.*  ``garl`` asks for one candidate after the other, each in a stratum.  The best one
   should show a kind of violation that few flights showed, violate a property that nothing like it
   violated, or is one that the model knows little of.  Whatever is like it is worth less from then
   on, so that a generation does not hold one scenario twenty times.

Why a model and not the flights: children of flights that violated something, bred without one,
repeated what was known.  Why whole genes of flown scenarios: their effect was seen, and a child
says which of its parents' conditions it joins.  Why NSGA-II and not the best by one figure: each
property has its own best candidates, so that one that is hard to violate does not go under.  Why
rarity and not the probability of a violation: with that, half of the children were violations of
the two most frequent kinds.  Why strata: NPCs differ in values that the model can tell least of, so
that without strata hardly any was chosen.

For example: in flight ``g00-s03`` a strong wind lowered the margin of distance to half, in
``g01-s07`` so did a late clock of the camera.  Neither violated anything, and no flight had both.
The model adds the two effects up and is unsure of what they do together.  The child with this wind,
this clock and a dog that was drawn anew is flown; its parents are ``g00-s03`` and ``g01-s07``.

A row is a chromosome, and beside it stands where each of its genes is from: the flown scenario, or
nobody.  So each candidate can say who its parents are, however many generations of the model lie
between.  A candidate that has not two is no child, and is dropped.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pymoo.core.population import Population
from pymoo.core.problem import Problem
from pymoo.operators.survival.rank_and_crowding import RankAndCrowding

from pytest_garl.scenarios.genes import OFF, ON, ON_ABOVE
from pytest_garl.search.columns import Columns, Mask
from pytest_garl.search.exploration import LONE_NPC_SHARE, Exploration
from pytest_garl.search.model import MarginModel, share_above
from pytest_garl.search.operators import Matrix

POPULATION, GENERATIONS = 60, 8
MUTATION_SHARE = 0.9
"""Share of children with a gene that neither parent has."""
OPTIMISM = 0.5
"""The objectives are what the model thinks possible: this many standard deviations nearer."""
TRIES = 20
"""Tries for a child before a generation stays small: parents may have too few genes."""
NOBODY = -1
DRAWN = 8
"""Values of each gene that are drawn for a generation; children that mutate take one of them."""
NPC_SHARE = 0.67
"""Share of added genes that are an NPC, in rows that may have one more."""
UNSEEN_WORTH = 0.3
"""Worth of a property that is surely violated, and that nothing alike violated yet, compared with a
kind of violation that no flight showed."""
UNKNOWN_WORTH = 0.5
"""Worth of a candidate that the model knows nothing of, compared with a sure new failure."""
LEAST_SPREAD = 0.1
"""Of a proximity: the model is never surer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Brood:
    """Candidates: chromosomes (m, d), and beside them (m, g) which flight each gene is from.

    A gene that does not act, or has values that were never flown, is from :data:`NOBODY`.
    ``bases`` (m,) are the flights that gave the rest: what always acts, and the seed.
    """

    rows: Matrix
    sources: NDArray[np.int64]
    bases: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, index: Any) -> Self:
        return type(self)(
            rows=self.rows[index], sources=self.sources[index], bases=self.bases[index]
        )

    def __add__(self, other: Self) -> Self:
        return type(self)(
            rows=np.concatenate([self.rows, other.rows]),
            sources=np.concatenate([self.sources, other.sources]),
            bases=np.concatenate([self.bases, other.bases]),
        )


_Child = tuple[Matrix, NDArray[np.int64], int]
"""A row, where its genes are from, and the flight that gave the rest."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen:
    """A child to fly: its chromosome, and the flights that it has genes of, by the gene's number.

    ``base`` is the flight that gave the rest.  ``proximity`` is what the model expects of each
    property, ``fails`` the probability of a violation.
    """

    row: Matrix
    sources: Mapping[int, int]
    base: int
    proximity: tuple[float, ...]
    fails: float


class Evolution:
    """Breeds one generation: from flown chromosomes (n, d), in a model that is fitted to them."""

    def __init__(
        self,
        columns: Columns,
        exploration: Exploration,
        model: MarginModel,
        flown: Matrix,
        rng: np.random.Generator,
    ) -> None:
        self._columns, self._model = columns, model
        self._rng = rng
        numbers = {gene.start: number for number, gene in enumerate(columns.slices)}
        self._optional = {numbers[gene.bit]: gene for gene in columns.optional}
        self._npcs = frozenset(n for n, gene in self._optional.items() if gene.is_npc)
        self._is_sparse = bool(columns.optional) and not columns.genome.is_dense
        self._crossed = tuple(self._optional if self._is_sparse else numbers.values())
        """The nuclear genes that show a child's parents."""
        self._flown = self._of_flights(flown)
        self._drawn = exploration.drawn(flown[-1], rng, DRAWN)

    def candidates(self) -> Brood:
        """Return all candidates that evolve; none if the flights have too few genes to cross."""
        survival, best = RankAndCrowding(), self._flown
        values = self._objectives(best.rows)
        problem = Problem(n_var=1, n_obj=values.shape[1])
        best, values, order = self._survivors(survival, problem, best, values, len(best))
        found = best[:0]
        for _ in range(GENERATIONS):
            made = self._offspring(best, order)
            if not len(made):
                break
            found += made
            both = np.concatenate([values, self._objectives(made.rows)])
            best, values, order = self._survivors(survival, problem, best + made, both, POPULATION)
        return found

    def _of_flights(self, rows: Matrix) -> Brood:
        """Return the flights as candidates, each with all of its genes from itself."""
        sources = np.full((len(rows), len(self._columns.slices)), NOBODY)
        for flight, genes in enumerate(self._acting(rows)):
            sources[flight, genes] = flight
        return Brood(rows=rows, sources=sources, bases=np.arange(len(rows)))

    def _acting(self, rows: Matrix) -> list[list[int]]:
        """Return for each row which of the nuclear genes that are crossed act in it."""
        firsts = [self._columns.slices[gene].start for gene in self._crossed]
        acts = rows[:, firsts] > ON_ABOVE
        acts |= np.array([first not in self._columns.bits for first in firsts])
        return [[self._crossed[place] for place in np.flatnonzero(own)] for own in acts]

    def _objectives(self, rows: Matrix) -> Matrix:
        """Return what is minimised, (m, p + 2)."""
        expected = self._model.predict(rows)
        possible = expected.proximity + OPTIMISM * expected.spread
        unlike = 1 - expected.likeness.max(axis=1)
        return -np.column_stack([possible, expected.rarity, unlike])

    def _survivors(
        self, survival: Any, problem: Problem, brood: Brood, values: Matrix, count: int
    ) -> tuple[Brood, Matrix, Sequence[tuple[float, float]]]:
        """Return the survivors of rank and crowding, their objectives, and what orders them."""
        people = Population.new("F", values, "place", np.arange(len(values)))
        left = survival.do(
            problem, people, n_survive=min(count, len(values)), random_state=self._rng
        )
        places = left.get("place").astype(int)
        order = [
            (float(a), -float(b))
            for a, b in zip(left.get("rank"), left.get("crowding"), strict=True)
        ]
        return brood[places], values[places], order

    def _offspring(self, brood: Brood, order: Sequence[tuple[float, float]]) -> Brood:
        """Return a generation of children, each with whole genes of two flights or more."""
        rng, made = self._rng, list[_Child]()
        acting = self._acting(brood.rows)
        for _ in range(TRIES * POPULATION):
            if len(made) == POPULATION:
                break
            first, second = (
                min((int(each) for each in rng.integers(len(brood), size=2)), key=order.__getitem__)
                for _ in range(2)
            )
            cross = self._crossed_sparse if self._is_sparse else self._crossed_dense
            child = cross(brood, acting, first, second)
            if child is not None and np.unique(child[1][child[1] != NOBODY]).size > 1:
                made.append(child)
        if not made:
            return brood[:0]
        rows, sources, bases = zip(*made, strict=True)
        return Brood(rows=np.array(rows), sources=np.array(sources), bases=np.array(bases))

    def _crossed_sparse(
        self, brood: Brood, acting: Sequence[Sequence[int]], first: int, second: int
    ) -> _Child | None:
        """Return a child with conditions or NPCs of both; None if they have not two different ones.

        The rest, such as the place of the marker, is from the parent that gave the NPC, because
        whether it meets the UAV depends on it.
        """
        rng, columns = self._rng, self._columns
        chosen: dict[int, int] = {}
        lone = rng.random() < LONE_NPC_SHARE
        mutates = rng.random() < MUTATION_SHARE
        # Of two NPCs one is the drawn one.
        adds_npc = mutates and rng.random() < NPC_SHARE
        for parent in (first, second):
            self._take(chosen, acting[parent], parent, lone=lone, without=adds_npc and lone)
        if len(chosen) < 2:
            return None
        if len(chosen) < columns.limit and not mutates:
            parent = (first, second)[int(rng.integers(2))]
            self._take(chosen, acting[parent], parent, lone=lone)
        npcs = [gene for gene in chosen if gene in self._npcs]
        base = chosen[npcs[0]] if npcs else (first, second)[int(rng.integers(2))]
        row = brood.rows[base].copy()
        sources = np.full(len(columns.slices), NOBODY)
        for gene in self._crossed:
            row[columns.slices[gene].start] = OFF
        for gene, parent in chosen.items():
            own = columns.slices[gene]
            row[own] = brood.rows[parent, own]
            row[own.start] = ON
            sources[gene] = brood.sources[parent, gene]
        if len(chosen) < columns.limit and mutates:
            self._add_drawn(row, chosen, npc=adds_npc)
        return row, sources, int(brood.bases[base])

    def _take(
        self,
        chosen: dict[int, int],
        genes: Sequence[int],
        parent: int,
        *,
        lone: bool,
        without: bool = False,
    ) -> None:
        """Add one of a parent's genes to those that are chosen, if it has another one.

        It is no NPC if there shall be none, or one is chosen and is to be alone.
        """
        no_npc = without or (lone and any(gene in self._npcs for gene in chosen))
        left = [
            gene for gene in genes if gene not in chosen and not (no_npc and gene in self._npcs)
        ]
        if left:
            chosen[left[int(self._rng.integers(len(left)))]] = parent

    def _add_drawn(self, row: Matrix, chosen: Mapping[int, int], *, npc: bool) -> None:
        """Let another gene act, in place, an NPC or a condition, with values that were drawn."""
        rng = self._rng
        left = [gene for gene in self._crossed if gene not in chosen]
        wanted = [gene for gene in left if (gene in self._npcs) == npc] or left
        if wanted:
            gene = self._optional[wanted[int(rng.integers(len(wanted)))]]
            drawn = self._drawn[gene.name]
            row[gene.bit] = ON
            row[gene.values] = drawn[int(rng.integers(len(drawn)))]

    def _crossed_dense(
        self, brood: Brood, acting: Sequence[Sequence[int]], first: int, second: int
    ) -> _Child:
        """Return a child with each nuclear gene of one of two parents; half have one drawn anew."""
        rng, columns = self._rng, self._columns
        row, sources = brood.rows[first].copy(), brood.sources[first].copy()
        takes = rng.random(len(columns.slices)) < 0.5
        for gene in np.flatnonzero(takes):
            row[columns.slices[gene]] = brood.rows[second, columns.slices[gene]]
            sources[gene] = brood.sources[second, gene]
        if rng.random() < MUTATION_SHARE:
            drawn = columns.slices[changed := int(rng.integers(len(columns.slices)))]
            row[drawn] = columns.genome.random(rng)[drawn]
            sources[changed] = NOBODY
        return row, sources, int(brood.bases[first])


class Choice:
    """Chooses among candidates, one after another: each takes away from what those like it offer.

    ``violated`` (n, p) says which properties each flight violated.
    """

    def __init__(self, brood: Brood, model: MarginModel, violated: Matrix) -> None:
        self._brood, self._model = brood, model
        self._expected = expected = model.predict(brood.rows)
        spread = np.maximum(LEAST_SPREAD, expected.spread)
        self._likely = share_above(expected.proximity, 1.0, spread)
        self._rare = expected.rarity.copy()
        alike = expected.likeness * expected.likeness
        self._repeats = np.einsum("ij,jp->ip", alike, violated[model.first :])
        self._unknown = expected.variance / float(expected.variance.max(initial=1e-9))
        self._left = np.ones(len(brood), dtype=bool)

    def best(self, allowed: Mask) -> Chosen | None:
        """Return the best of the allowed candidates that are left, None if there is none."""
        open_ = self._left & allowed
        if not open_.any():
            return None
        unseen = (self._likely / (1 + self._repeats)).max(axis=1)
        worth = self._rare + UNSEEN_WORTH * unseen + UNKNOWN_WORTH * self._unknown
        best = int(np.argmax(np.where(open_, worth, -1.0)))
        self._left[best] = False
        rows = self._brood.rows
        alike = self._model.likeness(rows, rows[best : best + 1])[:, 0]
        alike *= alike
        self._repeats += alike[:, None] * self._likely[best]
        self._unknown *= 1 - alike
        self._rare *= 1 - alike
        return Chosen(
            row=rows[best],
            sources={
                gene: int(flight)
                for gene, flight in enumerate(self._brood.sources[best])
                if flight != NOBODY
            },
            base=int(self._brood.bases[best]),
            proximity=tuple(float(each) for each in self._expected.proximity[best]),
            fails=float(self._expected.fails[best]),
        )
