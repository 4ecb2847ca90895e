"""What repair returns is what a file can write, so that a file flies as the search flew."""

from __future__ import annotations

import math

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pytest_garl.fiducial import MarkerSpec
from pytest_garl.scenarios.files import dumps, is_in_units, loads
from pytest_garl.scenarios.genes import SUN, genome_for, group_gene
from pytest_garl.scenarios.genome_like import with_destinations
from pytest_garl.scenarios.groups import GROUPS, QUANTITIES
from pytest_garl.scenarios.maps.loading import load_map, map_names
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import BIRD_HEIGHTS_M
from pytest_garl.scenarios.placed import MARKER_RADIUS_M, Placed, marker_genes
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.task import Start, Task
from pytest_garl.scenarios.units import from_sections, sections_of, snapped
from pytest_garl.scenarios.validity import repair

COURT = load_map("court")
TASKS = (
    Task(),
    Task(marker=MarkerSpec(id=3, side_m=0.8)),
    Task(start=Start(mode="hover", height_m=12.0, offset_m=(1.0, -2.0))),
)
GROUP_GENES = tuple(group_gene(group) for group in GROUPS.values())


@st.composite
def any_scenario(draw: st.DrawFn, map: Map) -> Scenario:
    """Draw a scenario with values of any digits: weather, some groups, heights, ways."""
    genome = genome_for(
        map,
        weather="full",
        extras=draw(st.lists(st.sampled_from(GROUP_GENES), unique=True)),
        task=draw(st.sampled_from(TASKS)),
    )
    if draw(st.booleans()):
        genome = with_destinations(genome)
    genes = {item.key: draw(st.floats(item.low, item.high)) for item in genome.properties}
    names = [name for name, kind in map.all_objects if kind == "bird"]
    for name in draw(st.lists(st.sampled_from(names), unique=True)) if names else []:
        genes[f"{name}.height_m"] = draw(st.floats(*BIRD_HEIGHTS_M))
    scenario = Scenario(map=map.name, seed=5, genes=tuple(genes.items()), task=genome.task)
    objects = [name for name, _ in map.all_objects]
    return scenario.without(*draw(st.lists(st.sampled_from(objects), unique=True)))


@pytest.mark.parametrize("name", map_names())
@given(data=st.data())
@settings(max_examples=150)
def test_a_file_gives_back_every_repaired_scenario(name: str, data: st.DataObject) -> None:
    map = load_map(name)
    scenario = repair(data.draw(any_scenario(map)), map)
    assert is_in_units(scenario, map)
    assert repair(scenario, map) == scenario
    assert loads(dumps(scenario, map), map) == scenario


@given(position=st.floats(0, 1), turn_deg=st.floats(-180, 180))
@example(position=0.0, turn_deg=-90.0)
@example(position=0.5, turn_deg=180.0)
@example(position=1.0, turn_deg=89.999)
@settings(max_examples=1000)
def test_snapping_the_sun_twice_moves_it_once(position: float, turn_deg: float) -> None:
    sun = PLAIN.replace({SUN: position, "light.turn_deg": turn_deg})
    once = snapped(sun, COURT)
    assert snapped(once, COURT) == once


@given(angle=st.floats(-math.pi, math.pi))
@settings(max_examples=1000)
def test_snapping_keeps_a_marker_at_the_edge_of_its_disc_inside(angle: float) -> None:
    x, y = COURT.gps_position_m
    edge = (x + MARKER_RADIUS_M * math.cos(angle), y + MARKER_RADIUS_M * math.sin(angle))
    once = snapped(PLAIN.replace(marker_genes(edge, COURT)), COURT)
    assert snapped(once, COURT) == once
    place = sections_of(once, COURT)["marker"]
    assert math.dist((place["x_m"], place["y_m"]), (x, y)) <= MARKER_RADIUS_M
    # Half a millimetre each way by rounding, or one each way back into the disc.
    assert math.dist(Placed(once, COURT).marker_m, edge) < 0.0022


def test_a_file_takes_a_condition_that_counts_to_the_nearest_whole_number() -> None:
    key = next(key for key, each in QUANTITIES.items() if each.whole)
    low, high = QUANTITIES[key].low, QUANTITIES[key].high
    value = high - 0.4 if high - 0.4 > low else low + 0.6
    scenario = snapped(PLAIN.replace({key: value}), COURT)
    assert scenario[key] == round(value) != value


def test_snapping_moves_nothing_by_more_than_its_last_digit() -> None:
    raw = PLAIN.replace(
        {
            "environment.fog": 0.1234567,
            "environment.rain": 0.1234567,
            "marker.x": 0.1234567,
            "person-1.start_x": 0.1234567,
            "wind.mean_mps": 1.234567,
        }
    )
    scenario = snapped(raw, COURT)
    assert scenario != raw
    assert scenario["environment.fog"] == pytest.approx(0.1234567, rel=1e-4)
    assert scenario["environment.rain"] == pytest.approx(0.1234567, rel=1e-4)
    assert scenario["wind.mean_mps"] == 1.2346
    assert math.dist(Placed(scenario, COURT).marker_m, Placed(raw, COURT).marker_m) < 0.001
    sections = sections_of(scenario, COURT)
    assert from_sections(sections, scenario, COURT) == scenario


PLAIN = repair(
    Scenario(
        map="court",
        seed=1,
        genes=tuple((item.key, item.nominal) for item in genome_for(COURT).properties),
    ),
    COURT,
)
