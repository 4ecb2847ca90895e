"""After the touchdown: stood with running motors, dragged, hit there."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from pytest_garl.flight.flight import Event, Flight, Touchdown, Track
from pytest_garl.verdicts.evidence import Evidence
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.touchdowns import HOP_M
from pytest_garl.verdicts.verdict import Limits
from pytest_garl.verdicts.wording import headline
from tests.verdicts.flights import CLEAR, FOGGY, flight, hit, nominal, step, touchdown, track


def on_ground(*samples: tuple[float, float, float]) -> Track:
    """Return a descent to the marker until 20 s, and then samples (time, x, height of the feet)."""
    ground = [(time_s, x, 0.0, 0.2 + up) for time_s, x, up in samples]
    return track((0.0, 0.0, 0.0, 10.0), (19.0, 0.0, 0.0, 1.0), *ground)


def touched(time_s: float, x: float = 0.0, **changes: Any) -> Touchdown:
    return touchdown(abs(x), time_s=time_s, on="marker", **{"stopped_s": None, **changes})


def stay(outcome: Any, path: Track, *touchdowns: Touchdown, **changes: Any) -> Flight:
    end_s = float(path.time_s[-1])
    x, y, z = (float(value) for value in path.position_m[-1])
    *earlier, last = touchdowns
    values = {"uav": path, "touchdown": last, "earlier_touchdowns": tuple(earlier)}
    return flight(outcome, (x, y, z), **{"elapsed_s": end_s, **values, **changes})


DRAGGED = on_ground((20.0, 0.0, 0.0), (22.0, 0.05, 0.06), (24.0, 0.05, 0.0), (27.0, 3.0, 0.0))


def dog(time_s: float) -> Any:
    return (dataclasses.replace(hit("dog-1", "dog", "dynamic")[0], time_s=time_s),)


@pytest.mark.parametrize(("up", "number"), [(HOP_M - 0.001, 1), (HOP_M, 2)])
def test_a_hop_from_which_a_fall_is_not_hard_begins_no_new_stay(up: float, number: int) -> None:
    path = on_ground((20.0, 0.0, 0.0), (21.0, 0.0, up), (22.0, 0.0, 0.0), (30.0, 0.0, 0.0))
    subject = stay("not_landed", path, touched(20.0), touched(22.0))
    found = Evidence(subject).stays
    assert len(found) == number
    assert [each.since_s for each in found] == [20.0, 22.0][:number]
    assert Evidence(subject).stands_since_s(30.0) == (20.0 if number == 1 else 22.0)


@pytest.mark.parametrize("outcome", ["slid", "not_landed", "gave_up", "collision"])
def test_a_uav_that_stood_on_the_marker_and_was_dragged_is_told_from_its_touchdown_on(
    outcome: Any,
) -> None:
    # The simulator notes the second touchdown off the marker.
    contacts = dog(27.0) if outcome == "collision" else ()
    subject = stay(
        outcome, DRAGGED, touched(20.0), touched(26.0, 2.0, slid_m=1.0), contacts=contacts
    )
    verdict = judge(subject, Limits())
    assert (verdict.primary, verdict.signature) == ("distance", "slid:motors-on")
    assert verdict.story.startswith(
        "Touched down 0.0 m off the marker at 20.0 s, stood there with running motors until "
        "27.0 s, then slid 3.0 m over the ground, with hops of up to 6 cm, with the motors running"
    )
    assert (" before it met dog-1." in verdict.story) == (outcome == "collision")
    assert headline(verdict.story).startswith("touched down 0.0 m off the marker at 20.0 s")
    margins = {each.property: each for each in verdict.margins}
    assert margins["distance"].value == pytest.approx(0.75 - 3.0)
    assert margins["slide"].value == pytest.approx(0.5 - 3.0)
    if outcome != "slid":
        assert Evidence(subject, Limits()).off_marker_m == pytest.approx(3.0)


def test_a_uav_that_hops_within_the_limit_and_lands_has_landed() -> None:
    path = on_ground((20.0, 0.0, 0.0), (22.0, 0.3, 0.05), (23.0, 0.6, 0.0), (26.0, 0.6, 0.0))
    first = touched(20.0, speed_mps=1.2)
    subject = stay("landed", path, first, touched(23.0, 0.6, speed_mps=0.1, stopped_s=24.0))
    verdict = judge(subject, Limits())
    assert (verdict.primary, verdict.completed) == (None, True)
    assert Evidence(subject).landed_s == 20.0
    margins = {each.property: each.value for each in verdict.margins}
    assert margins["time"] == pytest.approx(100.0)
    assert margins["touchdown_speed"] == pytest.approx(0.8)
    assert margins["slide"] > 0


def test_a_touchdown_off_the_marker_stays_one_if_the_uav_hops_onto_it() -> None:
    path = on_ground((20.0, 2.0, 0.0), (22.0, 1.0, 0.05), (23.0, 0.1, 0.0), (26.0, 0.1, 0.0))
    subject = stay("landed", path, touched(20.0, 2.0), touched(23.0, 0.1, stopped_s=24.0))
    assert judge(subject, Limits()).signature == "I:marker:unseen"
    assert "before it landed on the marker" in judge(subject, Limits()).story


def test_a_uav_that_rises_and_flies_off_is_not_dragged() -> None:
    path = on_ground((20.0, 0.0, 0.0), (21.0, 0.1, 0.3), (24.0, 3.0, 4.0))
    abort = (Event(time_s=20.5, name="abort_command", text=""),)
    verdict = judge(stay("gave_up", path, touched(20.0), events=abort), Limits())
    assert verdict.signature == "II:never-seen"
    assert "stood" not in verdict.story


def test_standing_until_the_time_is_up_is_no_lost_marker_and_never_excused() -> None:
    seen = (step(5.0, marker=CLEAR), step(39.0, marker=FOGGY))
    path = on_ground((20.0, 0.0, 0.0), (40.0, 0.0, 0.01))
    subject = stay("not_landed", path, touched(20.0), steps=seen, nominal_views=nominal(FOGGY))
    verdict = judge(subject, Limits(time_s=40.0))
    assert (verdict.violation_type, verdict.signature) == ("late", "late:standing")
    assert (verdict.excuse, verdict.no_landing) == ("", "needless")
    assert verdict.story.startswith("Not landed, although it stood 0.0 m off the marker.")
    assert "It stood on the ground from 20.0 s on; its motors never stopped." in verdict.story


def test_giving_up_on_the_ground_is_told_as_standing_there() -> None:
    path = on_ground((20.0, 0.0, 0.0), (30.0, 0.0, 0.0), (31.0, 0.0, 0.3), (35.0, 0.0, 5.0))
    abort = (Event(time_s=30.0, name="abort_command", text=""),)
    verdict = judge(stay("gave_up", path, touched(20.0), events=abort), Limits())
    assert verdict.signature == "late:standing"
    assert "It had stood on the ground from 20.0 s to 31.0 s and had not stopped" in verdict.story


@pytest.mark.parametrize(("after_s", "phase"), [(1.499, "last-metre"), (1.5, "standing")])
def test_a_body_that_hits_a_standing_uav_is_told_apart_from_one_that_hits_a_landing_one(
    after_s: float, phase: str
) -> None:
    end_s = 20.0 + after_s
    path = on_ground((20.0, 0.0, 0.0), (end_s, 0.0, 0.0))
    subject = stay("collision", path, touched(20.0), contacts=dog(end_s))
    verdict = judge(subject, Limits())
    assert verdict.signature == f"IV:dog:{phase}:unseen"
    told = (
        "It had stood on the ground since 20.0 s and had not stopped its motors." in verdict.story
    )
    assert told == (phase == "standing")
    assert headline(verdict.story).startswith("collided with dog-1 at 2.5 m/s")


def test_a_uav_whose_motors_stop_does_not_stand_with_running_motors() -> None:
    path = on_ground((20.0, 0.0, 0.0), (25.0, 0.0, 0.0))
    subject = stay("landed", path, touched(20.0, stopped_s=22.0))
    assert Evidence(subject).phase_at(21.9) == "standing"
    assert Evidence(subject).phase_at(22.0) == "last-metre"
