"""Repaired scenarios are valid, and nothing else of them changes."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.files import dumps, loads
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map, map_names
from pytest_garl.scenarios.strategies import scenarios
from pytest_garl.scenarios.validity import problems, repair

COURT = load_map("court")


@pytest.mark.parametrize("map", map_names())
@given(data=st.data())
@settings(max_examples=60)
def test_every_drawn_scenario_is_valid_and_survives_its_file(map: str, data: st.DataObject) -> None:
    scenario = data.draw(scenarios(map))
    place = load_map(map)
    assert problems(scenario, place) == ()
    assert repair(scenario, place) == scenario
    assert loads(dumps(scenario, place), place) == scenario


def test_repair_changes_only_the_offending_genes() -> None:
    genome = genome_for(COURT)
    nominal = decode(genome.nominal, genome, map="court", seed=1)
    on_marker = nominal.replace({"dog-1.start_x": 0.0, "dog-1.start_y": 0.0})
    mended = repair(on_marker, COURT)
    changed = {key for key, value in on_marker.genes if mended[key] != value}
    assert changed <= {"dog-1.start_x", "dog-1.start_y"} | {
        key for key, _ in nominal.genes if repair(nominal, COURT)[key] != nominal[key]
    }
    assert {"dog-1.start_x", "dog-1.start_y"} & changed


def test_an_object_is_put_where_rounding_leaves_it_clear_of_others() -> None:
    """The first ring with room ends as far from the bird as the two are wide, to the micrometre."""
    lawn = load_map("lawn")
    genome = genome_for(lawn)
    nominal = decode(genome.nominal, genome, map="lawn", seed=1)
    beside = {"bird-1.start_x": 1.0, "bird-1.start_y": 0.0}
    mended = repair(nominal.replace({**beside, "dog-1.start_x": 1.0, "dog-1.start_y": 0.0}), lawn)
    assert problems(mended, lawn) == ()
