"""The user's marker and start travel with every scenario."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from pytest_garl.errors import ScenarioError
from pytest_garl.fiducial import MarkerSpec, NestedMarker
from pytest_garl.landing_system import Airframe
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.files import dump_scenario, dumps, loads, parse_scenario
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.genome_like import with_destinations
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.task import Start, Task
from pytest_garl.scenarios.validity import clearance_m, problems, repair
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.system_under_test.mission import mission_for

COURT = load_map("court")
TASK = Task(
    marker=MarkerSpec(
        dictionary="DICT_APRILTAG_36h11",
        id=12,
        side_m=0.8,
        nested=(NestedMarker(id=3, side_m=0.15, offset_m=(0.7, -0.1)),),
    ),
    start=Start(mode="hover", height_m=8.0, offset_m=(1.0, -2.0)),
)


def scenario(task: Task = TASK) -> Scenario:
    genome = genome_for(COURT, task=task)
    return repair(decode(genome.nominal, genome, map="court", seed=3), COURT)


def test_a_search_breeds_scenarios_with_its_task() -> None:
    genome = genome_for(COURT, task=TASK)
    assert all(each.task == TASK for each in random_scenarios(COURT, genome, 1, 0, 3))
    bound = with_destinations(genome)
    drawn = decode(bound.random(np.random.default_rng(1)), bound, map="court", seed=1)
    assert drawn.task == TASK


def test_a_task_survives_the_file_and_the_ledger() -> None:
    assert loads(dumps(scenario(), COURT), COURT) == scenario()
    assert parse_scenario(dump_scenario(scenario())) == scenario()


def test_a_file_states_no_task_that_is_the_default() -> None:
    assert "task" not in dumps(scenario(Task()), COURT)
    assert loads(dumps(scenario(Task()), COURT), COURT).task == Task()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("DICT_APRILTAG_36h11", "DICT_8X8", "key 'task.marker': .*found dictionary = 'DICT_8X8'"),
        ("id = 12", "id = 600", "key 'task.marker': .*found id = 600, expected .* 0 to 586"),
        ('mode = "hover"', 'mode = "fly"', "key 'task.start': .*found mode = 'fly'"),
        (
            "height_m = 8.0",
            "height_m = 0.5",
            "key 'task.start': .*found height_m = 0.5, expected 2 to 100 m",
        ),
        ("side_m = 0.8", "size_m = 0.8", "key 'task.marker.size_m': unknown key"),
    ],
)
def test_a_broken_task_names_file_and_key(old: str, new: str, message: str) -> None:
    text = dumps(scenario(), COURT).replace(old, new)
    with pytest.raises(ScenarioError, match=rf"^broken.toml: {message}"):
        loads(text, COURT, source="broken.toml")


def test_a_map_states_its_marker(tmp_path: Path) -> None:
    text = (Path(str(load_map.__code__.co_filename)).parent / "lawn.toml").read_text()
    table = '\n[marker]\ndictionary = "DICT_APRILTAG_36h11"\nid = 5\nside_m = 0.5\n'
    (tmp_path / "yard.toml").write_text(text + table)
    yard = load_map("yard", (tmp_path,))
    assert yard.marker == MarkerSpec(dictionary="DICT_APRILTAG_36h11", id=5, side_m=0.5)
    drawn = random_scenarios(yard, genome_for(yard), 1, 0, 1)[0]
    mission = mission_for(Placed(drawn, yard), Airframe(), 60.0)
    assert (mission.marker_dictionary, mission.marker_id) == ("DICT_APRILTAG_36h11", 5)
    assert mission.marker_side_m == 0.5
    (tmp_path / "broken.toml").write_text(text + table.replace("id = 5", "id = -1"))
    with pytest.raises(ScenarioError, match=r"broken.toml: key 'marker.id'"):
        load_map("broken", (tmp_path,))


def test_a_mission_names_the_nested_markers() -> None:
    mission = mission_for(Placed(scenario(), COURT), Airframe(), 60.0)
    assert mission.nested_markers == TASK.marker.nested


def test_a_large_marker_lies_farther_from_what_stands_about() -> None:
    small, usual, large = (clearance_m(MarkerSpec(side_m=side)) for side in (0.3, 1.5, 4.0))
    assert small == pytest.approx(1.0)
    assert usual == pytest.approx(1.5 / 2**0.5 + 0.25)
    assert large == pytest.approx(4 / 2**0.5 + 0.25)
    wide = dataclasses.replace(scenario(), task=Task(marker=MarkerSpec(side_m=4.0)))
    assert not problems(repair(wide, COURT), COURT)
