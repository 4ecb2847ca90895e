"""Each way to fail, shown by a landing system with one behaviour in the built-in simulator."""

from __future__ import annotations

import pytest

from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import Limits, Verdict
from tests.verdicts.behaviours import (
    Last,
    Place,
    Route,
    fail,
    fall,
    fly_on_and_give_up,
    give_up,
    hover,
    land,
    land_and_drift,
    land_sideways,
    scene,
    touch_and_give_up,
)

pytestmark = pytest.mark.sim
HERE = {"marker.x": 0.3, "marker.y": -0.2}
COURT = scene(genes=HERE)
FAR_NORTH = scene(genes={"marker.x": 0.0, "marker.y": 0.95})
DECOY: Place = (-5.6, 4.4)


def _beside(x_m: float, y_m: float) -> Place:
    return COURT.marker[0] + x_m, COURT.marker[1] + y_m


def _verdict(*places: Place, last: Last, hold_s: float = 0.0, time_s: float = 120.0) -> Verdict:
    flight = COURT.fly(Route(*places, last=last, hold_s=hold_s))
    return judge(flight, Limits(time_s=time_s))


def test_a_landing_on_the_marker_completes_the_mission() -> None:
    verdict = _verdict(COURT.marker, last=land)
    assert (verdict.outcome, verdict.primary, verdict.completed) == ("landed", None, True)
    assert not verdict.paper_violation


@pytest.mark.parametrize(
    ("place", "last", "signature", "story"),
    [
        (_beside(1.1, 0.0), land, "off:seen", "Landed 1.1 m off the marker; the marker was in"),
        (
            _beside(1.1, 0.0),
            touch_and_give_up,
            "off:seen",
            "Touched the ground 1.1 m off the marker before it gave up",
        ),
        (DECOY, land, "I:decoy-marker-3:seen", "Landed 9.2 m off the marker, on decoy-marker-3"),
        ((7.5, -4.0), land, "I:line:seen", "on a line"),
        ((4.0, -12.0), touch_and_give_up, "I:nothing:seen", "on open ground"),
        (_beside(-2.1, 0.0), land_sideways(2.5), "slid:motors-on", "with the motors running"),
        (_beside(-2.4, 0.0), land_and_drift(4.0), "slid:motors-on", "over the ground"),
        (COURT.marker, fall, "hard:fast", "Touched down too fast"),
        (COURT.marker, fail, "V:ValueError@behaviours.fail", "no plan at"),
    ],
)
def test_a_landing_in_the_wrong_way_has_its_type(
    place: Place, last: Last, signature: str, story: str
) -> None:
    verdict = _verdict(place, last=last)
    assert verdict.signature == signature
    assert story in verdict.story
    assert not verdict.completed


def test_a_blind_landing_is_a_landing_on_nothing_that_was_seen() -> None:
    flight = FAR_NORTH.fly(Route((0.0, -13.2), last=land))
    verdict = judge(flight, Limits())
    assert verdict.signature == "I:line:unseen"
    assert "the marker was never readable" in verdict.story


def test_a_landing_in_a_shadow_names_the_shadow() -> None:
    lawn = scene("lawn", {"environment.sun_position": 0.35})
    verdict = judge(lawn.fly(Route((5.0, -5.0), last=land)), Limits())
    assert verdict.signature.startswith("I:shadow:")
    assert "on a shadow" in verdict.story


@pytest.mark.parametrize(
    ("last", "hold_s", "signature", "story"),
    [
        (give_up, 20.0, "II:gave-up-in-sight:approach", "with the marker in view"),
        (give_up, 95.0, "late:no-time:approach", "for want of time; the marker was in view"),
        (hover, 0.0, "late:not-landed:approach", "although the marker was in view to the end"),
        (fly_on_and_give_up((3.0, -13.0), 20.0), 5.0, "II:lost:search", "was last readable at"),
    ],
)
def test_a_flight_without_landing_has_its_cause(
    last: Last, hold_s: float, signature: str, story: str
) -> None:
    verdict = _verdict(COURT.marker, last=last, hold_s=hold_s)
    assert (verdict.primary, verdict.signature) == ("time", signature)
    assert story in verdict.story
    assert verdict.no_landing == "needless"
    assert verdict.paper_violation


@pytest.mark.parametrize(("last", "outcome"), [(give_up, "gave_up"), (hover, "not_landed")])
def test_a_system_that_never_looks_for_the_marker_never_sees_it(last: Last, outcome: str) -> None:
    verdict = judge(FAR_NORTH.fly(Route(last=last)), Limits())
    assert (verdict.outcome, verdict.signature) == (outcome, "II:never-seen")
    assert verdict.excuse == ""


def test_a_late_landing_completes_the_mission_and_violates_the_time() -> None:
    verdict = _verdict(COURT.marker, last=land, hold_s=50.0, time_s=60.0)
    assert (verdict.signature, verdict.completed) == ("late:landed:approach", True)
    assert not verdict.paper_violation


def test_a_marker_under_snow_excuses_giving_up() -> None:
    snow = scene(genes=HERE | {"environment.road_snow": 0.9})
    verdict = judge(snow.fly(Route(snow.marker, last=give_up, hold_s=5.0)), Limits())
    assert (verdict.primary, verdict.excuse) == (None, "undetectable")
    assert "The marker could not be read for long enough" in verdict.story


def test_a_person_who_stays_on_the_marker_excuses_giving_up_and_not_a_collision() -> None:
    blocked = scene(genes=HERE, person_on_marker=True)
    waits = judge(blocked.fly(Route(blocked.marker, last=give_up, hold_s=50.0)), Limits())
    assert (waits.primary, waits.excuse) == (None, "blocked")
    assert "people or animals" in waits.story
    hurries = judge(blocked.fly(Route(blocked.marker, last=give_up, hold_s=5.0)), Limits())
    assert hurries.signature == "II:gave-up-in-sight:approach"
    lands = judge(blocked.fly(Route(blocked.marker, last=land)), Limits())
    assert lands.signature.startswith("IV:person:descent:")
    assert lands.findings == ()


def test_a_flight_into_a_tree_hits_it() -> None:
    lawn = scene("lawn")
    flight = lawn.fly(Route((4.6, 4.2), last=land))
    verdict = judge(flight, Limits())
    assert verdict.signature.startswith("III:tree:")
    assert verdict.story.startswith("Came down ")
    assert [each.signature for each in verdict.findings] == ["off:descending-elsewhere"]
