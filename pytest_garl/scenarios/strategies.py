"""Hypothesis strategies over scenarios, for property-based tests of landing systems."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hypothesis import strategies as st

from pytest_garl.scenarios.genes import WeatherRange, genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.quantities import Quantity
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair

_STEPS = 1000


def scenarios(
    map: str = "court",
    *,
    weather: WeatherRange = "confined",
    search_path: Sequence[Path] = (),
) -> st.SearchStrategy[Scenario]:
    """Return a strategy of valid scenarios on a map that shrinks towards nominal.

    Values lie on 1,000 steps either side of nominal, because Hypothesis shrinks whole
    numbers towards zero but floats towards "simple" ones; places that make no sense are
    repaired, not filtered.
    """
    place = load_map(map, search_path)
    genome = genome_for(place, weather=weather)
    values = st.tuples(*(_value(item) for item in genome.properties))

    def build(drawn: tuple[tuple[float, ...], int]) -> Scenario:
        genes = tuple(zip(genome.keys, drawn[0], strict=True))
        return repair(Scenario(map=map, seed=drawn[1], genes=genes, task=genome.task), place)

    return st.tuples(values, st.integers(0, 2**32 - 1)).map(build)


def _value(item: Quantity) -> st.SearchStrategy[float]:
    below = -_STEPS if item.nominal > item.low else 0
    above = _STEPS if item.nominal < item.high else 0

    def scale(step: int) -> float:
        end = item.high if step > 0 else item.low
        share = abs(step) / _STEPS
        return end if share == 1 else item.nominal + share * (end - item.nominal)

    return st.integers(below, above).map(scale)
