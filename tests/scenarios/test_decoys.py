"""Decoys lie clear of the marker, of the map's own decoy and of each other, and are looked at."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import cv2
import numpy as np
import pytest

from pytest_garl import Camera
from pytest_garl.errors import ScenarioError
from pytest_garl.fiducial import MarkerSpec, NestedMarker
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.files import dumps, loads
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.groups import DECOY_KINDS
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.task import Task
from pytest_garl.scenarios.units import conditions_in_words
from pytest_garl.scenarios.validity import problems, repair
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.randomness import generator
from tests.support.flights import EMPTY

MAPS = {name: dataclasses.replace(load_map(name), objects=()) for name in ("court", "lawn")}


def scenario_on(name: str, values: Mapping[str, float]) -> Scenario:
    genome = genome_for(MAPS[name])
    scenario = decode(genome.nominal, genome, map=name, seed=5)
    return repair(scenario.replace(values), MAPS[name])


@pytest.mark.parametrize("name", MAPS)
def test_decoys_are_moved_off_the_marker_and_off_each_other(name: str) -> None:
    # All at the coordinate, or all at the map's own decoy.
    for x, y in ((0.0, 0.0), (-5.6, 4.4)):
        values = {f"decoy-{number}.kind": float(number) for number in (1, 2, 3)}
        values |= {f"decoy-{number}.x_m": x for number in (1, 2, 3)}
        values |= {f"decoy-{number}.y_m": y for number in (1, 2, 3)}
        scenario = scenario_on(name, values)
        assert problems(scenario, MAPS[name]) == ()
        assert repair(scenario, MAPS[name]) == scenario
        assert loads(dumps(scenario, MAPS[name]), MAPS[name]) == scenario
        places = [each.place_m for each in Placed(scenario, MAPS[name]).decoys]
        places.append(Placed(scenario, MAPS[name]).marker_m)
        places += [each.points_m[0] for each in MAPS[name].ground.layers if each.kind == "marker"]
        gaps = [
            np.hypot(a[0] - b[0], a[1] - b[1])
            for index, a in enumerate(places)
            for b in places[index + 1 :]
        ]
        # Two diagonals of 1.5 m touch at 2.12 m.
        assert min(gaps) > 2.12


@pytest.mark.parametrize("kind", range(1, len(DECOY_KINDS)))
@pytest.mark.parametrize("name", MAPS)
def test_every_kind_is_seen_on_both_maps(name: str, kind: int) -> None:
    pictures = []
    for values in ({}, {"decoy-1.kind": float(kind), "decoy-1.x_m": 4.0, "decoy-1.y_m": -4.0}):
        scenario = scenario_on(name, values)
        camera = Camera()
        place = MAPS[name]
        renderer = Renderer(Placed(scenario, place), camera, generator(scenario.seed, "sensor"))
        frame = renderer.render((4.0, -4.0, 4.0), (0.0, 0.0, 0.0, 1.0), 0.0, [])
        pictures.append(frame.image.astype(int))
        grey = cv2.cvtColor(frame.image, cv2.COLOR_RGB2GRAY)
    change = np.abs(pictures[0] - pictures[1]).max(axis=2) > 30
    side = 1.5 * camera.focal_px / 4.0
    assert 0.3 * side**2 < change.sum() < 2.0 * side**2
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_50)
    _, ids, _ = cv2.aruco.ArucoDetector(family).detectMarkers(grey)
    found = set() if ids is None else set(np.ravel(ids).tolist())
    if DECOY_KINDS[kind] == "other-id":
        assert found == {1}
    elif DECOY_KINDS[kind] != "same-id-without-margin":
        assert 0 not in found


def test_a_scenario_without_decoys_has_none() -> None:
    assert Placed(scenario_on("lawn", {}), EMPTY).decoys == ()


def test_an_active_decoy_has_a_kind_and_a_cause_names_it_by_that() -> None:
    values = {"decoy-1.kind": 0.01, "decoy-2.kind": 0.9, "decoy-2.x_m": 5.0}
    found = Placed(scenario_on("lawn", values), MAPS["lawn"]).decoys
    assert [each.kind for each in found] == ["other-id", "other-id"]
    assert {each.layer.name for each in found} == {"decoy-other-id"}


def test_another_id_is_not_one_of_the_board() -> None:
    nested = (NestedMarker(id=1, side_m=0.3), NestedMarker(id=2, side_m=0.2, offset_m=(0.5, 0.0)))
    scenario = scenario_on("lawn", {"decoy-1.kind": 1.0})
    scenario = dataclasses.replace(scenario, task=Task(marker=MarkerSpec(nested=nested)))
    assert [each.id for each in Placed(scenario, MAPS["lawn"]).decoys] == [3]


def test_a_decoy_without_room_is_left_out() -> None:
    values = {f"decoy-{number}.kind": 4.0 for number in (1, 2, 3)}
    wide = MarkerSpec(side_m=5.0, nested=(NestedMarker(id=9, side_m=1.0, offset_m=(5.0, 5.0)),))
    genome = genome_for(MAPS["lawn"])
    scenario = decode(genome.nominal, genome, map="lawn", seed=5).replace(values)
    scenario = repair(dataclasses.replace(scenario, task=Task(marker=wide)), MAPS["lawn"])
    assert problems(scenario, MAPS["lawn"]) == ()
    assert Placed(scenario, MAPS["lawn"]).decoys == ()
    assert repair(scenario, MAPS["lawn"]) == scenario


@pytest.mark.parametrize("number", range(1, len(DECOY_KINDS)))
def test_a_file_states_the_name_of_the_kind_and_may_state_its_number(number: int) -> None:
    scenario = scenario_on("lawn", {"decoy-1.kind": float(number), "decoy-1.x_m": 4.0})
    text = dumps(scenario, MAPS["lawn"])
    named = f'kind = "{DECOY_KINDS[number]}"\n'
    assert named in text
    assert loads(text, MAPS["lawn"]) == scenario
    for written in (f"kind = {number}\n", f"kind = {number}.0\n"):
        assert loads(text.replace(named, written), MAPS["lawn"]) == scenario


def test_a_decoy_whose_kind_is_none_is_not_there() -> None:
    scenario = scenario_on("lawn", {"decoy-1.kind": 5.0, "decoy-1.x_m": 4.0})
    text = dumps(scenario, MAPS["lawn"]).replace('"window"', '"none"')
    assert Placed(loads(text, MAPS["lawn"]), MAPS["lawn"]).decoys == ()


@pytest.mark.parametrize("found", ["'helipad'", "8", "-1", "true", "['window']", "nan"])
def test_an_unknown_kind_is_one_message_with_the_names(found: str) -> None:
    scenario = scenario_on("lawn", {"decoy-1.kind": 5.0, "decoy-1.x_m": 4.0})
    text = dumps(scenario, MAPS["lawn"]).replace('"window"', found)
    with pytest.raises(ScenarioError) as caught:
        loads(text, MAPS["lawn"], source="mat.toml")
    assert str(caught.value) == (
        f"mat.toml: key 'scenario.decoy-1.kind': found {found.replace('true', 'True')}, expected "
        "one of none, other-id, same-id-without-margin, helipad-h, chequered-mat, window, grate, "
        "qr-code, or a number from 0 to 7"
    )


def test_a_decoy_outside_a_domain_is_named() -> None:
    scenario = scenario_on("lawn", {"decoy-1.kind": 5.0, "decoy-1.x_m": 4.0})
    found = domain_named("calm").outside(scenario, MAPS["lawn"])
    assert "decoy-1.kind = window, the domain has only none" in found


def test_a_reader_sees_the_name_of_the_kind() -> None:
    scenario = scenario_on("lawn", {"decoy-1.kind": 0.9, "decoy-1.x_m": 4.0})
    assert ("decoy-1.kind", "other-id") in conditions_in_words(scenario, MAPS["lawn"])
