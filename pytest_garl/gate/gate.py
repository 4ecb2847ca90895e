"""The gate compares flights with a baseline set; it flies neighbours of new violation types."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence

from pytest_garl.errors import BaselineError
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.gate.baseline_file import BaselineSet
from pytest_garl.gate.comparison import LEVEL, Comparison, compare
from pytest_garl.gate.pairs import FlightSummary, Pair, summary_of
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.plan import NEIGHBOURS
from pytest_garl.shrinking.robustness import neighbours

FlyScenarios = Callable[[Sequence[Scenario]], Sequence[CompletedFlight]]
"""Flies scenarios with the changed landing system."""


def compare_flights(
    base: BaselineSet,
    flights: Iterable[CompletedFlight],
    map: Map,
    fly: FlyScenarios,
    *,
    level: float = LEVEL,
    expected_signatures: Collection[str] = (),
) -> Comparison:
    """Return the comparison of a set with new flights of its scenarios, in the set's order.

    ``fly`` flies neighbours of the scenarios that show a new violation type.
    """
    head = [summary_of(done.result, done.sha256) for done in flights]
    return _compare(base, head, map, fly, level, expected_signatures)


def compare_sets(
    base: BaselineSet, head: BaselineSet, map: Map, fly: FlyScenarios, *, level: float = LEVEL
) -> Comparison:
    """Return the comparison of two sets; raise BaselineError unless their scenarios are equal."""
    if [each.scenario for each in base.flights] != [each.scenario for each in head.flights]:
        raise BaselineError(f"{base.title}: the two landing systems did not fly the same scenarios")
    return _compare(base, [each.summary for each in head.flights], map, fly, level, ())


def _compare(
    base: BaselineSet,
    head: Sequence[FlightSummary],
    map: Map,
    fly: FlyScenarios,
    level: float,
    expected_signatures: Collection[str],
) -> Comparison:
    pairs = [
        Pair(name=base.scenario_name(index), base=flight.summary, head=summary)
        for index, (flight, summary) in enumerate(zip(base.flights, head, strict=True))
    ]
    found = compare(pairs, level=level, expected_signatures=expected_signatures)
    names = [pair.name for pair in found.pairs_to_confirm]
    if not names:
        return found
    scenarios = {
        base.scenario_name(index): each.scenario for index, each in enumerate(base.flights)
    }
    neighbour_results = fly([each for name in names for each in neighbours(scenarios[name], map)])
    summaries = [summary_of(done.result, done.sha256) for done in neighbour_results]
    neighbour_flights = {
        name: summaries[index * NEIGHBOURS : (index + 1) * NEIGHBOURS]
        for index, name in enumerate(names)
    }
    return compare(
        pairs, level=level, expected_signatures=expected_signatures, neighbours=neighbour_flights
    )
