"""What a test reads of a landing: figures, infinity, or a skip with the reason."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.plugin.items.landing import Landing
from pytest_garl.plugin.items.target import Target
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.verdicts.verdict import Limits
from tests.support.results import flight_result

BLOCKED = "The marker was blocked: a dog sat on it."


class System:
    """A landing system in name."""


def landing(is_shown_elsewhere: Callable[[], bool] = lambda: False, **result: Any) -> Landing:
    target = Target(system=System, limits=Limits(), domain=domain_named("field"), map="lawn")
    flown = flight_result(**result)
    flight = CompletedFlight(result=flown, sha256="", record=Path("none.npz"))
    return Landing(target, flight, is_shown_elsewhere=is_shown_elsewhere)


def read(of: Landing, name: str) -> Any:
    """Return an attribute, or the reason why its test is skipped."""
    try:
        return getattr(of, name)
    except pytest.skip.Exception as skipped:
        return str(skipped)


LANDED: dict[str, Any] = {
    "outcome": "landed",
    "final_distance_m": 0.2,
    "elapsed_s": 33.4,
    "completed": True,
}
NEEDLESS: dict[str, Any] = {
    "outcome": "gave_up",
    "signature": "II:lost:descent",
    "primary": "time",
    "undecided": "gave up at 30.0 s",
}
SHOWN = "not judged: another test of this flight fails for "


@pytest.mark.parametrize(
    ("result", "distance_m", "time_s", "completed", "excused"),
    [
        ({**LANDED, "landed_s": 30.0}, 0.2, 30.0, True, ""),
        # A simulator of a user's own records no touchdown.
        (LANDED, 0.2, 33.4, True, ""),
        (
            {**LANDED, "completed": False, "off_marker_m": 9.0, "signature": "I:line:seen"}
            | {"primary": "distance", "elapsed_s": 200.0},
            9.0,
            120.0,
            False,
            "",
        ),
        (
            {"outcome": "slid", "signature": "slid:motors-off", "primary": "distance"}
            | {"undecided": "slid"},
            math.inf,
            "not judged: slid",
            False,
            "",
        ),
        (NEEDLESS, "not judged: gave up at 30.0 s", math.inf, False, ""),
        (
            {**NEEDLESS, "signature": "I:nothing:seen", "primary": "distance", "off_marker_m": 9.0},
            9.0,
            "not judged: gave up at 30.0 s",
            False,
            "",
        ),
        (
            {"outcome": "gave_up", "excuse": "blocked", "excuse_text": BLOCKED},
            f"not judged: {BLOCKED}",
            f"not judged: {BLOCKED}",
            False,
            BLOCKED,
        ),
        (
            {"outcome": "not_landed", "signature": "late:not-landed:search", "primary": "time"}
            | {"undecided": "not landed after 120 s"},
            "not judged: not landed after 120 s",
            math.inf,
            False,
            "",
        ),
        # limits(abort="ok") allows it.
        (
            {"outcome": "gave_up", "undecided": "gave up at 30.0 s"},
            "not judged: gave up at 30.0 s",
            "not judged: gave up at 30.0 s",
            "not judged: gave up at 30.0 s",
            "",
        ),
    ],
)
def test_properties_of_each_outcome(
    result: dict[str, Any], distance_m: Any, time_s: Any, completed: Any, excused: str
) -> None:
    one = landing(**result)
    assert read(one, "distance_to_landing_m") == distance_m
    assert read(one, "time_to_landing_s") == time_s
    assert read(one, "completed") == completed
    assert read(one, "excused") == excused
    assert not one.left_to_another_test


@pytest.mark.parametrize("name", ["completed", "collisions"])
def test_property_is_left_to_another_test_that_fails_for_the_violation(name: str) -> None:
    touched = {"outcome": "collision", "signature": "I:line:seen", "primary": "distance"}
    hit = {**touched, "collisions": ("dog-1",), "off_marker_m": 9.0}
    shown = landing(lambda: True, **hit)
    assert read(shown, name) == f"{SHOWN}I:line:seen"
    assert shown.left_to_another_test
    alone = landing(lambda: False, **hit)
    assert read(alone, name) == {"completed": False, "collisions": ("dog-1",)}[name]
    assert not alone.left_to_another_test


def test_collisions_of_a_landing_off_the_marker_that_hit_nothing_are_judged() -> None:
    off = {**LANDED, "signature": "I:line:seen", "primary": "distance", "completed": False}
    one = landing(lambda: True, **off)
    assert one.collisions == ()
    assert not one.left_to_another_test


def test_completed_mission_is_not_left_to_another_test() -> None:
    late = {**LANDED, "signature": "late:landed:descent", "primary": "time", "landed_s": 130.0}
    one = landing(lambda: True, **late)
    assert one.completed
    assert one.time_to_landing_s == 130.0
