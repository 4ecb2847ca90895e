from __future__ import annotations

import dataclasses

import pytest

from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.case_comparison import (
    Contents,
    Removed,
    all_removed,
    is_simpler,
    no_worse,
    simplicity,
)
from tests.cases.samples import OBJECT_NAMES, case

LAWN = load_map("lawn")
GENOME = genome_for(LAWN)
NOMINAL = decode(GENOME.nominal, GENOME, map="lawn", seed=0)
NAMES = [name for name, _ in LAWN.all_objects]
EMPTY = NOMINAL.without(*NAMES)
CAMERA = {
    "camera.mounting_pitch_deg": 2.0,
    "camera.mounting_yaw_deg": -2.0,
    "camera.calibration_error_percent": 2.0,
    "camera.exposure_ms": 5.0,
    "camera.dirt_percent": 15.0,
}
FOG, WIND = {"environment.fog": 0.5}, {"wind.mean_mps": 3.0, "wind.towards_deg": 90.0}


@pytest.mark.parametrize(
    ("before", "after", "text"),
    [
        (NOMINAL, NOMINAL, "nothing"),
        (EMPTY.replace(CAMERA), EMPTY.replace(CAMERA), "nothing"),
        (EMPTY.replace(CAMERA | FOG), EMPTY.replace(CAMERA), "1 of 2 conditions (1 of 6 values)"),
        (EMPTY.replace(FOG | WIND), EMPTY.replace(FOG), "1 of 2 conditions"),
        (NOMINAL, NOMINAL.without(*NAMES[1:]), f"{len(NAMES) - 1} of {len(NAMES)} objects"),
        (
            NOMINAL.without(*NAMES[1:]).replace(FOG),
            NOMINAL.without(*NAMES[1:]),
            "0 of 1 object, 1 of 1 condition",
        ),
        (EMPTY.replace({"marker.x": 0.5}), EMPTY, "1 of 1 condition"),
        # A straight crossing may have more than what was found.
        (EMPTY, NOMINAL, "nothing"),
    ],
)
def test_what_was_removed_is_counted_in_objects_conditions_and_values(
    before: Scenario, after: Scenario, text: str
) -> None:
    found = Removed.between(before, after)
    assert found.text == text
    if text != "nothing":
        assert Removed.parse(text) == found


def test_all_values_of_a_camera_are_one_condition() -> None:
    found = Contents.of(EMPTY.replace(CAMERA))
    assert found == Contents(objects=0, conditions=1, values=5)


def test_what_was_removed_adds_up() -> None:
    one = "1 of 4 objects, 2 of 14 conditions (3 of 20 values)"
    two = "2 of 3 objects, 5 of 12 conditions (6 of 17 values)"
    assert all_removed(one, two) == "3 of 4 objects, 7 of 14 conditions (9 of 20 values)"
    assert all_removed(one, "nothing") == one
    assert all_removed("nothing", two) == two


def test_a_text_without_counts_adds_nothing() -> None:
    assert all_removed("the fog, by hand", "1 of 3 objects") == "1 of 3 objects"


SAVED = case()


def test_case_with_fewer_runs_is_simpler() -> None:
    shorter = dataclasses.replace(SAVED, moves=((OBJECT_NAMES[-1], ((0.0, 0.0),)),))
    assert is_simpler(shorter, SAVED, LAWN, outdated=False)
    assert not is_simpler(SAVED, shorter, LAWN, outdated=False)
    assert not is_simpler(SAVED, SAVED, LAWN, outdated=False)


def test_case_that_is_worse_in_one_respect_is_not_simpler() -> None:
    shorter = dataclasses.replace(SAVED, moves=((OBJECT_NAMES[-1], ((0.0, 0.0),)),), live=False)
    assert not no_worse(simplicity(shorter, LAWN), simplicity(SAVED, LAWN))
    assert not is_simpler(shorter, SAVED, LAWN, outdated=False)


def test_case_with_new_evidence_is_simpler_than_an_outdated_one() -> None:
    assert is_simpler(SAVED, SAVED, LAWN, outdated=True)
