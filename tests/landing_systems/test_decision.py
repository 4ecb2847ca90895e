from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable

from landing_systems.modules.decision import Decision, DecisionModule, DecisionParameters
from pytest_garl import Camera, Detection, Mission

P = DecisionParameters()
MISSION = Mission(
    gps_position_m=(10.0, 0.0),
    home_m=(0.0, 0.0, 0.0),
    search_altitude_m=10.0,
    marker_id=0,
    marker_side_m=1.5,
    marker_dictionary="DICT_5X5_50",
    camera=Camera(),
    time_limit_s=120.0,
)
MARKER = (8.0, 1.0)
ABOVE = (*MARKER, 10.0)
FRAME_S = 0.1


def seen(x: float, y: float, *, number: int = 0, confidence: float = 0.9) -> Detection:
    return Detection(marker_id=number, confidence=confidence, position_m=(x, y, 0.0))


class Pilot:
    """Feeds a decision module frame after frame."""

    def __init__(self, mission: Mission = MISSION) -> None:
        self.module = DecisionModule(mission)
        self.time_s = 0.0

    def frame(
        self, at: tuple[float, float, float], detections: Iterable[Detection] | None = ()
    ) -> Decision:
        self.time_s += FRAME_S
        return self.module.decide(self.time_s, at, detections)

    def frames(
        self, count: int, at: tuple[float, float, float], detections: tuple[Detection, ...] = ()
    ) -> Decision:
        return [self.frame(at, detections) for _ in range(count)][-1]

    def confirmed(self) -> Pilot:
        assert self.frames(P.confirm_count, ABOVE, (seen(*MARKER),)).phase == "approach"
        return self


def test_it_takes_off_flies_to_the_coordinate_and_searches_around_it() -> None:
    pilot = Pilot()
    assert pilot.frame((0, 0, 0)).phase == "take-off"
    decision = pilot.frame((0, 0, 9.5))
    assert (decision.phase, decision.goal_m) == ("transit", (10.0, 0.0, 10.0))
    assert pilot.frame((9.8, 0, 10)).phase == "search"


def test_a_marker_is_believed_after_four_of_eight_looks_that_agree() -> None:
    pilot = Pilot()
    for spot in (MARKER, None, MARKER, (8.2, 1.1), None):
        assert pilot.frame(ABOVE, [seen(*spot)] if spot else []).phase == "confirm"
    decision = pilot.frame(ABOVE, [seen(*MARKER)])
    assert decision.phase == "approach"
    assert decision.target_m is not None
    assert abs(decision.target_m[0] - 8.05) < 1e-9


def test_frames_without_a_look_do_not_count_against_the_marker() -> None:
    looked, slept = Pilot(), Pilot()
    for turn in range(P.confirm_count):
        for _ in range(3):
            assert looked.frame(ABOVE, ()).phase != "approach"
            assert slept.frame(ABOVE, None).phase != "approach"
        last = turn == P.confirm_count - 1
        looks = looked.frame(ABOVE, [seen(*MARKER)]), slept.frame(ABOVE, [seen(*MARKER)])
        assert [each.phase for each in looks] == ["confirm", "approach" if last else "confirm"]


def test_other_ids_unsure_sightings_and_jumping_ones_are_no_marker() -> None:
    for spot in (seen(*MARKER, number=2), seen(*MARKER, confidence=0.7)):
        assert Pilot().frames(20, ABOVE, (spot,)).target_m is None
    pilot = Pilot()
    for turn in range(20):
        jumping = seen(8.0 + 2.0 * (turn % 3), 1.0)
        assert pilot.frame(ABOVE, (jumping,)).target_m is None


def test_it_descends_over_the_marker_and_commits_low() -> None:
    pilot = Pilot().confirmed()
    assert pilot.frame((8.0, 6.0, 10.0), (seen(*MARKER),)).phase == "approach"
    assert pilot.frame(ABOVE, (seen(*MARKER),)).phase == "descend"
    assert pilot.frame((*MARKER, 1.9), (seen(*MARKER),)).phase == "commit"
    assert pilot.frames(50, (*MARKER, 0.5)).phase == "commit"


def test_a_commitment_is_taken_back_when_something_is_in_the_way() -> None:
    pilot = Pilot().confirmed()
    assert pilot.frame((*MARKER, 1.9), (seen(*MARKER),)).phase == "commit"
    pilot.module.interrupt()
    assert pilot.frame((*MARKER, 3.0), (seen(*MARKER),)).phase == "descend"


def test_a_marker_out_of_sight_is_looked_for_from_higher_up_and_not_for_ever() -> None:
    pilot, low = Pilot().confirmed(), (*MARKER, 4.0)
    assert pilot.frame(low, (seen(*MARKER),)).phase == "descend"
    assert pilot.frames(round(P.lost_hold_s / FRAME_S) - 2, low).phase == "approach"
    decision = pilot.frames(4, low)
    assert (decision.phase, decision.goal_m[2]) == ("regain", 4.0 + P.regain_climb_m)
    # Seen again, it goes on; never again, it gives up while there is time to get home.
    assert pilot.frame(low, (seen(*MARKER),)).phase == "descend"
    while (decision := pilot.frame((*MARKER, 7.0))).phase != "abort":
        assert pilot.time_s < MISSION.time_limit_s
    assert pilot.time_s <= MISSION.time_limit_s - P.abort_reserve_s + 2 * FRAME_S


def test_a_marker_elsewhere_takes_the_targets_place_once_confirmed() -> None:
    pilot = Pilot().confirmed()
    other = (13.0, -2.0)
    decision = pilot.frames(P.confirm_count - 1, ABOVE, (seen(*other),))
    assert decision.target_m == MARKER
    decision = pilot.frames(2, ABOVE, (seen(*other),))
    assert decision.target_m is not None
    assert abs(decision.target_m[0] - other[0]) < 1e-9


def test_a_smaller_marker_is_followed_farther_down() -> None:
    pilot = Pilot(dataclasses.replace(MISSION, marker_side_m=0.6)).confirmed()
    assert pilot.frame((*MARKER, 1.9), (seen(*MARKER),)).phase == "descend"
    assert pilot.frame((*MARKER, 0.7), (seen(*MARKER),)).phase == "commit"


def test_a_narrow_camera_searches_in_smaller_steps_over_the_same_disc() -> None:
    steps = {}
    for degrees in (45.0, 90.0):
        camera = Camera(field_of_view_rad=math.radians(degrees))
        pilot = Pilot(dataclasses.replace(MISSION, camera=camera))
        pilot.frame((0, 0, 9.5))
        places = [(10.0, 0.0)]
        while (decision := pilot.frame((*places[-1], 10.0))).phase == "search":
            places.append(decision.goal_m[:2])
        reach = max(math.dist(place, (10.0, 0.0)) for place in places)
        assert abs(reach - P.search_radius_m) < 1e-9
        steps[degrees] = len(places)
    assert steps[45.0] > 2 * steps[90.0]
