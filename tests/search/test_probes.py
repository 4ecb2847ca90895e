"""Probes have one cause each, and find the bugs of published landing systems."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math

import pytest

from pytest_garl import Camera, Start
from pytest_garl.flight.flight import Flight, Track
from pytest_garl.flight.thresholds import feet_height_m
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.conditions import active_conditions
from pytest_garl.scenarios.domains.domain import Domain
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.task import Task
from pytest_garl.scenarios.validity import problems
from pytest_garl.search.probes import (
    BESIDE_M,
    Probe,
    clear_scenario,
    probed_map,
    probes_for,
    start_beside,
)
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS, Verdict
from tests.support.probed_landers import FirstOfTheList, GoesOn, Lander, ZeroByDefault

LAWN, COURT = load_map("lawn"), load_map("court")
HOVER = Task(start=Start(mode="hover", height_m=6.0))
FIELD = domain_named("field")
CAMERA = Lander.airframe.camera


def flown(system: type, probe: Probe) -> Flight:
    return fly(probe.scenario, system, policy_spec("stationary"), map=LAWN)


@functools.cache
def beside() -> Probe:
    return start_beside(clear_scenario(LAWN, HOVER, FIELD), LAWN, FIELD)


@functools.cache
def twin() -> Flight:
    return flown(Lander, beside())


def probes(domain: Domain = FIELD, camera: Camera = CAMERA) -> dict[str, Probe]:
    """Return the probes of the good lander by their names."""
    scenario = start_beside(clear_scenario(LAWN, HOVER, domain), LAWN, domain).scenario
    found = probes_for(twin(), scenario, LAWN, domain, DEFAULT_LIMITS, camera)
    return {probe.name: probe for probe in found}


def test_the_twin_lands_and_its_marker_is_not_where_a_blind_landing_ends() -> None:
    assert twin().outcome == "landed"
    assert not judge(twin(), DEFAULT_LIMITS).violation
    placed = Placed(beside().scenario, LAWN)
    assert math.dist(placed.marker_m, placed.start_m[:2]) == pytest.approx(BESIDE_M, abs=0.01)


@pytest.mark.parametrize(
    ("system", "name"),
    [
        (FirstOfTheList, "other-markers"),
        (ZeroByDefault, "no-marker"),
        (GoesOn, "marker-gone-early"),
    ],
)
def test_a_probe_finds_the_bug_that_the_good_system_does_not_have(system: type, name: str) -> None:
    probe = probes()[name]
    broken, good = (
        judge(flown(system, probe), DEFAULT_LIMITS),
        judge(flown(Lander, probe), DEFAULT_LIMITS),
    )
    assert probe.is_violated(broken)
    assert broken.violation_type == "I"
    assert not probe.is_violated(good)


def test_until_its_event_a_probe_is_the_twin() -> None:
    probe = probes()["marker-gone"]
    event_s = probe.scenario["cover.from_s"]
    places = flown(Lander, probe).uav, twin().uav
    before = [(track.position_m[track.time_s <= event_s]).tolist() for track in places]
    assert before[0] == before[1]
    assert event_s == pytest.approx(6.5, abs=1.0)


def test_the_height_at_which_the_marker_goes_is_that_of_the_feet() -> None:
    probe = probes()["marker-gone"]
    index = int(twin().uav.time_s.searchsorted(probe.scenario["cover.from_s"], side="right")) - 1
    height_m = feet_height_m(float(twin().uav.position_m[index, 2]))
    assert f"{height_m:.1f} m up" in probe.sentence


def test_each_probe_is_valid_and_has_one_cause() -> None:
    causes = {
        name: {each.cause.partition("-")[0] for each in active_conditions(probe.scenario)}
        for name, probe in probes().items()
    }
    assert causes == {
        "no-marker": {"cover", "told"},
        "marker-gone-early": {"cover", "told"},
        "marker-gone": {"cover", "told"},
        "marker-back": {"cover", "told"},
        "other-markers": {"decoy", "told"},
        "marker-twice": {"decoy", "told"},
        "level-wind": {"wind", "told"},
        "start-over": set(),
        "start-behind": {"told"},
    }
    for probe in probes().values():
        assert not problems(probe.scenario, LAWN), probe.name
        assert not any(True for _ in _objects(probe))


def _objects(probe: Probe) -> list[str]:
    return [name for name, _ in LAWN.all_objects if name not in probe.scenario.removed_objects]


def test_the_marker_lies_within_the_triangle_of_the_others() -> None:
    probe = probes()["other-markers"]
    x, y = Placed(probe.scenario, LAWN).marker_m
    angles = sorted(
        math.atan2(each.place_m[1] - y, each.place_m[0] - x)
        for each in Placed(probe.scenario, LAWN).decoys
    )
    assert len(angles) == 3
    gaps = [b - a for a, b in itertools.pairwise(angles)]
    assert max(*gaps, 2 * math.pi - sum(gaps)) < math.pi


@pytest.mark.parametrize(
    ("outcome", "may_give_up", "violated"),
    [
        ("time", True, False),
        ("abort", True, False),
        ("distance", True, True),
        ("time", False, True),
    ],
)
def test_not_to_land_is_right_where_the_marker_is_hidden(
    outcome: str, may_give_up: bool, violated: bool
) -> None:
    verdict = Verdict(
        outcome="",
        primary=outcome,  # type: ignore[arg-type]  # a property
        violation_type=None,
        signature="",
        paper_violation=True,
        margins=(),
        story="",
    )
    probe = dataclasses.replace(beside(), may_give_up=may_give_up)
    assert probe.is_violated(verdict) is violated


@pytest.mark.parametrize(
    ("may_give_up", "story", "told"),
    [
        (
            True,
            "Gave up, excused. Nobody could see it. At 46.0 s the UAV was 9.8 m up, over the "
            "marker.",
            "gave up, 9.8 m up, over the marker",
        ),
        (
            False,
            "Gave up, excused. Nobody could see it. At 46.0 s the UAV was 9.8 m up, over the "
            "marker.",
            "gave up, excused, 9.8 m up, over the marker",
        ),
    ],
)
def test_a_marker_that_comes_back_late_is_not_said_to_be_readable_by_nobody(
    may_give_up: bool, story: str, told: str
) -> None:
    verdict = Verdict(
        outcome="gave_up",
        primary=None,
        violation_type=None,
        signature="",
        paper_violation=True,
        margins=(),
        story=story,
        excuse="undetectable",
    )
    assert dataclasses.replace(beside(), may_give_up=may_give_up).ending(verdict) == told


def test_what_the_domain_does_not_have_is_a_note() -> None:
    field, calm = probes(), probes(domain_named("calm"))
    assert not [name for name, probe in field.items() if probe.outside]
    inside = [name for name, probe in calm.items() if not probe.outside]
    assert inside == ["level-wind", "start-over", "start-behind"]
    assert calm["level-wind"].scenario["wind.mean_mps"] == 3.0
    assert any("cover.share_percent = 100" in text for text in calm["no-marker"].outside)
    assert calm["start-behind"].scenario["told.error_m"] == 2.0


def test_thick_air_may_give_up_the_marker_from_the_search_height_only() -> None:
    ground = clear_scenario(LAWN, Task(), FIELD)
    high = dataclasses.replace(twin(), uav=_raised(twin()))
    found = probes_for(high, ground, LAWN, FIELD, DEFAULT_LIMITS, Camera())
    probe = next(each for each in found if each.name == "marker-low")
    assert probe.may_give_up
    assert probe.scenario["environment.fog"] == 1.0
    assert "can be read below 7 m only" in probe.sentence


def _raised(flight: Flight) -> Track:
    """Return the flight's track as one from 10 m."""
    places = flight.uav.position_m.copy()
    places[:, 2] *= 10.0 / places[:, 2].max()
    return dataclasses.replace(flight.uav, position_m=places)


def test_a_flight_from_the_ground_arrives_beside_the_marker() -> None:
    paper = domain_named("paper")
    probe = start_beside(clear_scenario(LAWN, Task(), paper), LAWN, paper)
    placed = Placed(probe.scenario, LAWN)
    assert math.dist(placed.marker_m, placed.told_m) == pytest.approx(BESIDE_M, abs=0.01)
    assert placed.told_m == LAWN.gps_position_m
    assert not probe.outside


def test_probes_are_flown_on_a_map_without_other_markers() -> None:
    assert probed_map([COURT, LAWN]) is LAWN
    other = dataclasses.replace(LAWN, name="meadow")
    assert probed_map([other, LAWN]) is probed_map([LAWN, other]) is LAWN
    assert probed_map([COURT]) is COURT
