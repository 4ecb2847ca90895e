from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from pytest_garl.landing_system import Diagnostics
from pytest_garl.scenarios.bodies import rotate
from tests.reports.mcap.conftest import Exported
from tests.support.mcap_files import decoded, needs_extra
from tests.support.recorded_flights import recorded, seen
from tests.support.videos import PLAN, SPEAKS_FROM_S, TARGET

needs_extra()


def places(message: Any) -> list[tuple[float, float, float]]:
    return [(each.position.x, each.position.y, each.position.z) for each in message.poses]


def test_a_plan_is_told_once_with_the_error_of_the_position_subtracted(exported: Exported) -> None:
    ((time_ns, plan), *more) = exported.recording.topics["/plan"]
    step = next(each for each in exported.flight.steps if each.diagnostics)
    assert time_ns == round(step.time_s * 1e9) == round(SPEAKS_FROM_S * 1e9)
    error = step.estimation_error_m
    wanted = [tuple(a - b for a, b in zip(place, error, strict=True)) for place in PLAN]
    assert places(plan) == [pytest.approx(each) for each in wanted]
    assert plan.frame_id == "world"
    # The system's plan stays, and the error of its position changes.
    assert len(more) <= sum(each.diagnostics is not None for each in exported.flight.steps)
    _, target = exported.recording.topics["/target"][0]
    assert target.pose.position.x == pytest.approx(TARGET[0] - error[0])


def test_the_x_axes_of_a_plan_point_along_it() -> None:
    from pytest_garl.reports.mcap.path_topics import _path

    corners = [(0.0, 0.0, 5.0), (0.0, 2.0, 5.0), (0.0, 2.0, 1.0), (0.0, 2.0, 1.0), (-3.0, 2.0, 1.0)]
    path = decoded(_path(0, corners))
    turns = [each.orientation for each in path.poses]
    noses = [rotate((turn.x, turn.y, turn.z, turn.w), (1.0, 0.0, 0.0)) for turn in turns]
    down, west = (0.0, 0.0, -1.0), (-1.0, 0.0, 0.0)
    wanted = [(0.0, 1.0, 0.0), down, down, west, west]
    assert noses == [pytest.approx(each, abs=1e-9) for each in wanted]


def test_an_empty_plan_ends_the_last_one() -> None:
    from pytest_garl.reports.mcap.path_topics import PLAN as TOPIC
    from pytest_garl.reports.mcap.path_topics import plans

    steps = list(seen((), count=4))
    for index in (1, 2):
        said = Diagnostics(planned_path_m=PLAN)
        steps[index] = dataclasses.replace(steps[index], diagnostics=said)
    found = [each for each in plans(recorded(steps=tuple(steps))) if each.topic == TOPIC]
    assert [each.time_ns for each in found] == [100_000_000, 300_000_000]
    assert [len(decoded(each.message).poses) for each in found] == [2, 0]


def test_the_flown_path_begins_and_goes_on_as_the_record(exported: Exported) -> None:
    ((time_ns, path),) = exported.recording.topics["/path"]
    assert time_ns == 0
    track = exported.flight.uav.position_m
    assert places(path) == [pytest.approx(tuple(each)) for each in track]
