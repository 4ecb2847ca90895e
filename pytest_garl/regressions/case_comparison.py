"""Compare how simple two cases of one failure are, in every respect."""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass

from pytest_garl.regressions.case import Avoidable, Case
from pytest_garl.regressions.case_file import record_lines, size_of
from pytest_garl.regressions.complexity import complexity, genome_of
from pytest_garl.regressions.robustness import NEIGHBOURS
from pytest_garl.scenarios.maps.map import Map

_EXCUSED: dict[Avoidable, int] = {"live": 0, "recorded": 1, "no": 2}


@dataclass(frozen=True, slots=True, kw_only=True)
class Simplicity:
    """The respects in which two cases of one failure are compared; less of each is better.

    Objects; genes off nominal and their distance from it; decisions at which an object moves, and
    runs of equal moves; characters of the record in the file; neighbours that do not fail or were
    not flown; how much less the case asks of a repair; whether the evidence comes from other
    sources than today's.
    """

    objects: int
    genes: int
    distance: float
    moving: int
    runs: int
    characters: int
    doubtful_neighbours: int
    excused: int
    outdated: bool


def simplicity(case: Case, map: Map, *, outdated: bool = False) -> Simplicity:
    """Return how simple a case is."""
    objects, genes, distance, _ = complexity(case.scenario, genome_of(case.scenario, map))
    evidence = case.evidence
    return Simplicity(
        objects=objects,
        genes=genes,
        distance=distance,
        moving=sum(move != (0.0, 0.0) for _, own in case.moves for move in own),
        runs=sum(len(list(itertools.groupby(own))) for _, own in case.moves),
        characters=sum(len(line) for line in record_lines(case)),
        doubtful_neighbours=max(NEIGHBOURS, evidence.neighbours) - evidence.neighbours_failed,
        excused=_EXCUSED[case.avoidable],
        outdated=outdated,
    )


def no_worse(one: Simplicity, other: Simplicity) -> bool:
    """Return whether ``one`` is at least as simple as ``other`` in every respect."""
    names = [field.name for field in dataclasses.fields(Simplicity)]
    return all(getattr(one, name) <= getattr(other, name) for name in names)


def is_simpler(case: Case, saved: Case, map: Map, *, outdated: bool) -> bool:
    """Return whether a case is no worse than the saved one and better in one respect.

    ``outdated`` says that the saved case's evidence comes from other sources than today's.
    """
    one, other = simplicity(case, map), simplicity(saved, map, outdated=outdated)
    if one == other:
        return size_of(case) < size_of(saved)
    return no_worse(one, other)
