"""A UAV that holds its place is judged by what the system sees and plans."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from pytest_garl.execution.fly_and_judge import judged
from pytest_garl.flight.flight import HOLDS, Event, Flight, ObjectRecord, Step, Track
from pytest_garl.landing_system import Diagnostics
from pytest_garl.scenarios.bodies import Part, quaternion_of
from pytest_garl.verdicts.evidence import Evidence
from pytest_garl.verdicts.held import Held
from pytest_garl.verdicts.held_plans import part_offsets
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import Limits, Verdict
from tests.verdicts.flights import CLEAR, CRASH, FOGGY, detection, flight, nominal

LIMITS = Limits(distance_m=0.375)
DOWN = ((0.0, 0.0, 5.0), (0.0, 0.0, 0.8))
ON_MARKER = Diagnostics(
    target_m=(0.0, 0.0, 0.0), detections=(detection((0.0, 0.0, 0.0)),), planned_path_m=DOWN
)
NO_PLAN = dataclasses.replace(ON_MARKER, planned_path_m=(), note="the goal is in an obstacle")
Said = Callable[[float], Diagnostics | None]


def body(kind: str, places: Callable[[float], tuple[float, float]]) -> ObjectRecord:
    times = np.arange(0.0, 10.01, 0.1).round(1)
    position = np.array([(*places(t), 0.0) for t in times.tolist()])
    attitude = np.tile([0.0, 0.0, 0.0, 1.0], (len(times), 1))
    still = np.zeros_like(position)
    track = Track(time_s=times, position_m=position, attitude=attitude, velocity_mps=still)
    return ObjectRecord(name=f"{kind}-1", type=kind, track=track, moves=np.zeros((0, 2)))


def held(
    said: Said,
    *bodies: ObjectRecord,
    seen: Callable[[float], tuple[str, ...]] | None = None,
    marker: Any = CLEAR,
    outcome: Any = "held",
    **changes: Any,
) -> Flight:
    """Return a flight of 10 s that hovers 5 m above the marker, ten frames a second."""
    times = np.arange(0.0, 10.01, 0.1)
    visible = seen or (lambda _: tuple(each.name for each in bodies))
    steps = tuple(
        Step(
            time_s=t,
            command="PositionSetpoint",
            marker_visible=1.0,
            marker_px=40.0,
            objects_visible=visible(t),
            diagnostics=said(t),
            marker=marker,
        )
        for t in times.round(1).tolist()
    )
    at = np.tile([0.0, 0.0, 5.0], (len(times), 1))
    uav = Track(
        time_s=times,
        position_m=at,
        attitude=np.tile([0.0, 0.0, 0.0, 1.0], (len(times), 1)),
        velocity_mps=np.zeros_like(at),
    )
    values: dict[str, Any] = {
        "uav": uav,
        "steps": steps,
        "objects": bodies,
        "elapsed_s": 10.0,
        "events": (Event(time_s=0.0, name=HOLDS, text="holds"),),
    }
    return flight(outcome, (0.0, 0.0, 5.0), **(values | changes))


def verdict_of(said: Said, *bodies: ObjectRecord, **changes: Any) -> Verdict:
    return judge(held(said, *bodies, **changes), LIMITS)


def always(_: float) -> Diagnostics:
    return ON_MARKER


def stands(x: float, y: float) -> Callable[[float], tuple[float, float]]:
    return lambda _: (x, y)


def there(since_s: float, until_s: float) -> Callable[[float], tuple[float, float]]:
    """Return the places of a body that is on the marker for some time, and else far away."""
    return lambda t: (0.0, 0.0) if since_s <= t <= until_s else (8.0, 0.0)


def test_a_plan_down_to_the_marker_is_no_violation() -> None:
    found = verdict_of(always, body("dog", stands(3.0, 0.0)))
    assert (found.outcome, found.primary, found.completed) == ("held", None, True)
    assert not found.paper_violation
    assert found.story.startswith("Held its place; from 0.0 s on it had a plan for the marker.")


def test_plans_through_a_dog_are_a_collision() -> None:
    found = verdict_of(always, body("dog", there(4.0, 6.0)))
    assert (found.primary, found.violation_type) == ("collision", "IV")
    assert found.signature == "IV:dog:plan"
    assert found.story.startswith(
        "From 4.0 s to 6.0 s its plans led through dog-1, which had been in view for 4.0 s."
    )
    margin = found.margin("moving")
    assert margin is not None
    assert margin.value == 0.0


@pytest.mark.parametrize(
    ("obstacles", "sight"),
    [((), "unseen"), (((2.0, 0.0, 0.3),), "unseen"), (((0.1, 0.1, 0.6),), "seen")],
)
def test_the_signature_says_whether_an_obstacle_was_reported_there(
    obstacles: tuple[Any, ...], sight: str
) -> None:
    said = dataclasses.replace(ON_MARKER, obstacles_m=obstacles)
    found = verdict_of(lambda _: said, body("dog", there(4.0, 6.0)))
    assert found.signature == f"IV:dog:plan:{sight}"
    assert ("it reported no obstacle there" in found.story) is (sight == "unseen")


@pytest.mark.parametrize(("until_s", "counts"), [(4.3, False), (4.6, True)])
def test_plans_count_that_lead_through_a_body_for_half_a_second(
    until_s: float, *, counts: bool
) -> None:
    found = verdict_of(always, body("dog", there(4.0, until_s)))
    assert found.violation is counts


def test_a_body_that_the_camera_did_not_show_before_does_not_count() -> None:
    dog = body("dog", there(4.0, 6.0))
    assert not verdict_of(always, dog, seen=lambda _: ()).violation
    late = verdict_of(always, dog, seen=lambda t: ("dog-1",) if t >= 5.3 else ())
    assert not late.violation
    early = verdict_of(always, dog, seen=lambda t: ("dog-1",) if t >= 5.0 else ())
    assert early.signature == "IV:dog:plan"


def test_a_plan_that_ends_low_goes_on_to_the_ground() -> None:
    """A dog is lower than 0.8 m, where the plan ends; a person under a high plan is passed over."""
    dog, person = body("dog", stands(0.0, 0.0)), body("person", stands(0.0, 0.0))
    assert verdict_of(always, dog).signature == "IV:dog:plan"
    high = dataclasses.replace(ON_MARKER, planned_path_m=((0.0, 0.0, 5.0), (0.0, 0.0, 4.9)))
    assert not verdict_of(lambda _: high, person).violation


def test_plans_are_compared_in_the_world() -> None:
    """A system that errs by 5 m plans at the marker as it sees it."""
    away = dataclasses.replace(
        ON_MARKER, planned_path_m=((5.0, 0.0, 5.0), (5.0, 0.0, 0.8)), target_m=(5.0, 0.0, 0.0)
    )
    flown = held(lambda _: away, body("dog", stands(0.0, 0.0)))
    steps = tuple(
        dataclasses.replace(each, estimation_error_m=(5.0, 0.0, 0.0)) for each in flown.steps
    )
    assert judge(dataclasses.replace(flown, steps=steps), LIMITS).signature == "IV:dog:plan"


def test_the_margin_falls_with_the_distance_of_a_body() -> None:
    def separation_m(x: float) -> float:
        margin = verdict_of(always, body("person", stands(x, 0.0))).margin("moving")
        assert margin is not None
        assert margin.decided
        return margin.value

    values = [separation_m(x) for x in (0.6, 1.0, 1.5, 2.0, 3.0)]
    assert values[0] == 0.0
    assert values == sorted(values)
    assert values[-1] - values[-2] == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    ("off_m", "signature"), [(0.3, ""), (0.6, "off:hold"), (3.0, "I:person:hold")]
)
def test_a_target_off_the_marker_is_a_distance(off_m: float, signature: str) -> None:
    def said(t: float) -> Diagnostics:
        off = off_m if 4.0 <= t <= 4.6 else 0.0
        return dataclasses.replace(
            ON_MARKER, target_m=(off, 0.0, 0.0), detections=(detection((off, 0.0, 0.0)),)
        )

    found = verdict_of(said, body("person", stands(3.2, 0.0)))
    assert found.signature == signature
    assert found.primary == ("distance" if signature else None)
    margin = found.margin("distance")
    assert margin is not None
    assert margin.value == pytest.approx(0.375 - off_m)


def test_a_target_of_a_moment_is_no_violation() -> None:
    off = dataclasses.replace(ON_MARKER, target_m=(3.0, 0.0, 0.0))
    assert not verdict_of(lambda t: off if 4.0 <= t <= 4.3 else ON_MARKER).violation


def test_a_readable_marker_that_is_not_reported_is_lost() -> None:
    blind = dataclasses.replace(ON_MARKER, detections=())
    found = verdict_of(lambda t: ON_MARKER if t < 3.0 else blind)
    assert (found.violation_type, found.signature) == ("II", "II:lost:hold")
    assert not verdict_of(lambda t: ON_MARKER if t < 3.0 else blind, marker=FOGGY).violation


def test_a_system_that_only_plans_never_saw_the_marker() -> None:
    searching = Diagnostics(planned_path_m=((0.0, 0.0, 5.0), (4.0, 0.0, 5.0)))
    assert verdict_of(lambda _: searching).signature == "II:never-seen:hold"


def test_a_planner_that_ends_while_nobody_is_near_is_a_violation() -> None:
    found = verdict_of(lambda t: ON_MARKER if t < 4.0 else NO_PLAN)
    assert (found.primary, found.violation_type) == ("time", "V")
    assert found.signature == "V:no-plan:hold"
    assert "It said: the goal is in an obstacle." in found.story
    assert not verdict_of(lambda t: NO_PLAN if 4.0 <= t < 5.9 else ON_MARKER).violation


def test_a_planner_may_wait_while_somebody_is_on_the_marker() -> None:
    """The paper counts its error all the same."""
    person = body("person", there(3.5, 7.5))
    found = verdict_of(lambda t: NO_PLAN if 4.0 <= t <= 8.0 else ON_MARKER, person)
    assert not found.violation
    assert found.paper_violation
    assert found.story.startswith("Held its place. From 4.0 s to 8.0 s it had no plan while")


def test_a_planner_that_had_nowhere_to_go_has_not_ended() -> None:
    """It hovers at its goal."""
    here = dataclasses.replace(ON_MARKER, planned_path_m=((0.0, 0.0, 5.0), (1.0, 0.0, 5.0)))
    assert not verdict_of(lambda t: here if t < 4.0 else NO_PLAN).violation


def test_a_jump_of_its_position_moves_the_target_for_a_moment() -> None:
    flown = held(always)
    jumped = tuple(
        dataclasses.replace(
            each,
            estimation_error_m=(2.0 if each.time_s >= 4.0 else 0.0, 0.0, 0.0),
        )
        for each in flown.steps
    )
    never = dataclasses.replace(flown, steps=jumped)
    assert judge(never, LIMITS).signature == "I:nothing:hold"
    again = tuple(
        dataclasses.replace(
            each, diagnostics=dataclasses.replace(ON_MARKER, target_m=(2.0, 0.0, 0.0))
        )
        if each.time_s >= 5.0
        else each
        for each in jumped
    )
    assert judge(dataclasses.replace(flown, steps=again), LIMITS).primary != "distance"


def test_a_system_that_never_plans_has_not_ended() -> None:
    assert not verdict_of(lambda _: NO_PLAN).violation


@pytest.mark.parametrize(
    ("rule", "signature"),
    [("needless", "V:gave-up:hold"), ("ok", ""), ("violation", "V:gave-up:hold")],
)
def test_giving_up_ends_the_plan(rule: Any, signature: str) -> None:
    events = (
        Event(time_s=0.0, name=HOLDS, text=""),
        Event(time_s=9.9, name="abort_command", text=""),
    )
    flown = held(always, outcome="gave_up", events=events)
    found = judge(flown, dataclasses.replace(LIMITS, abort=rule))
    assert found.signature == signature
    unseen = dataclasses.replace(flown, nominal_views=nominal(FOGGY))
    excused = judge(unseen, dataclasses.replace(LIMITS, abort=rule))
    assert excused.excuse == "undetectable"
    assert excused.signature == ("abort:undetectable" if rule == "violation" else "")


def test_an_exception_is_judged_as_in_any_flight() -> None:
    found = verdict_of(always, outcome="crashed", crash=CRASH)
    assert (found.primary, found.signature) == ("crash", "V:PlannerError@planning_ego.plan")


def test_who_hits_the_hovering_uav_is_no_violation() -> None:
    from tests.verdicts.flights import hit

    flown = held(always, outcome="collision", contacts=hit("bird-1", "bird", "dynamic"))
    found = judge(flown, LIMITS)
    assert found.primary is None
    assert found.story.startswith("bird-1 met the UAV, which held its place.")
    assert judged(flown, LIMITS).closest_call == ""


def test_the_first_mistake_decides() -> None:
    dog = body("dog", there(6.0, 8.0))
    off = dataclasses.replace(ON_MARKER, target_m=(3.0, 0.0, 0.0))
    flown = held(lambda t: off if 2.0 <= t < 3.0 else ON_MARKER, dog)
    assert judge(flown, LIMITS).primary == "distance"
    result = judged(flown, LIMITS)
    # One event fails one test.
    assert result.collisions == ()
    assert result.off_marker_m == pytest.approx(3.0)
    assert Held(Evidence(flown, LIMITS)).through == ("dog-1",)


def test_a_result_tells_plans_as_a_landing() -> None:
    result = judged(held(lambda t: NO_PLAN if t < 1.0 else ON_MARKER), LIMITS)
    assert (result.outcome, result.off_marker_m, result.landed_s) == ("held", 0.0, 1.0)
    dog = judged(held(always, body("dog", there(4.0, 6.0))), LIMITS)
    assert dog.collisions == ("dog-1",)


def test_a_late_plan_is_late() -> None:
    flown = held(lambda t: NO_PLAN if t < 6.0 else ON_MARKER)
    found = judge(flown, dataclasses.replace(LIMITS, time_s=5.0))
    assert (found.primary, found.signature) == ("time", "late:planned:hold")


@pytest.mark.parametrize("said", [None, Diagnostics(phase="waits")])
def test_a_system_that_reports_nothing_is_not_judged(said: Diagnostics | None) -> None:
    flown = held(lambda _: said)
    assert judge(flown, LIMITS).primary is None
    result = judged(flown, LIMITS)
    assert result.inconclusive
    assert "planned_path_m" in result.undecided


def test_without_plans_a_collision_is_undecided() -> None:
    found = verdict_of(lambda _: NO_PLAN, body("dog", stands(0.0, 0.0)))
    margin = found.margin("collision")
    assert margin is not None
    assert not margin.decided
    assert "no planned path" in margin.reason


@pytest.mark.parametrize(
    ("shape", "point", "apart"),
    [
        ("box", (2.0, 0.0, 0.0), (1.5, 0.0, 0.0)),
        ("box", (2.0, 2.0, 3.0), (1.5, 1.5, 2.0)),
        ("box", (0.4, 0.4, 0.9), (0.0, 0.0, 0.0)),
        ("cylinder", (3.0, 4.0, 0.0), (2.7, 3.6, 0.0)),
        ("cylinder", (0.3, 0.3, 2.0), (0.0, 0.0, 1.0)),
        ("ellipsoid", (0.0, 0.0, 3.0), (0.0, 0.0, 2.0)),
        ("ellipsoid", (2.5, 0.0, 0.0), (2.0, 0.0, 0.0)),
    ],
)
def test_the_offset_from_a_part_is_that_of_its_shape(
    shape: Any, point: tuple[float, ...], apart: tuple[float, ...]
) -> None:
    part = Part(shape=shape, size_m=(1.0, 1.0, 2.0), position_m=(0.0, 0.0, 0.0))
    place, yaw = np.zeros((1, 3)), np.zeros(1)
    found = part_offsets(part, np.array([point]), place, yaw)
    assert found[0] == pytest.approx(apart)


def test_the_offset_from_a_part_follows_the_turns_of_part_and_body() -> None:
    part = Part(
        shape="box",
        size_m=(2.0, 0.2, 0.2),
        position_m=(1.0, 0.0, 0.0),
        rotation=quaternion_of(yaw_rad=np.pi / 2),
    )
    # In the body the part lies along y at x = 1; the body at (5, 0) looks north.
    place, yaw = np.array([[5.0, 0.0, 0.0]]), np.array([np.pi / 2])
    found = part_offsets(part, np.array([[5.9, 1.3, 0.0]]), place, yaw)
    assert found[0] == pytest.approx((0.2, 0.0, 0.0), abs=1e-9)
