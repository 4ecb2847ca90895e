from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from pytest_garl.flight.flight import Event, Flight
from pytest_garl.verdicts.clear_air import why_no_landing
from pytest_garl.verdicts.evidence import Evidence
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import Limits
from tests.verdicts.flights import CLEAR, FOGGY, flight, hit, step, touchdown, track

OVER, BESIDE = (0.1, 0.0, 0.0), (9.0, 0.0, 0.0)
GAVE_UP = (Event(time_s=12.0, name="abort_command", text="gives up"),)
HOVERS = track((0.0, 0.0, -10.0, 0.2), (10.0, 0.0, 0.0, 9.0), (30.0, 0.0, 0.0, 9.2))
STANDS = track((0.0, 0.0, -10.0, 0.2), (30.0, 0.0, -10.0, 0.2))


def why(subject: Flight) -> str:
    limits = Limits()
    return why_no_landing(Evidence(subject, limits), judge(subject, limits))


def seen(detected: Any = None, target: Any = None, view: Any = CLEAR) -> Any:
    steps = [step(float(n), detected=detected, target=target, marker=view) for n in range(30)]
    return {"steps": tuple(steps)}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, "in none of its 2 pictures."),
        (seen(view=FOGGY), "in none of its 30 pictures."),
        (
            seen(),
            "in 30 of its 30 pictures; it reported no detection, so nobody can say whether it saw",
        ),
        (seen(detected=OVER), "pictures, and it detected it at its place in 30."),
        (
            seen(detected=BESIDE),
            "pictures, and it detected it at its place in none, elsewhere in 30 (",
        ),
        (seen(target=OVER), "pictures, and it named its place as the target in 30."),
        ({"data_read": ("rangefinder_m",)}, ". It never looked at a picture."),
    ],
)
def test_a_flight_that_never_lands_says_what_it_saw(changes: Any, words: str) -> None:
    text = why(flight("not_landed", (0.0, 0.0, 9.2), uav=HOVERS, **changes))
    assert text.startswith("it never commanded a landing; from 10 s to the end at 30 s it hovered")
    assert words in text


def test_it_says_where_the_flight_ended() -> None:
    assert "it never left the ground. " in why(flight("not_landed", (0.0, -10.0, 0.2), uav=STANDS))
    moving = flight("not_landed", (0.0, 5.0, 4.2))
    assert "landing; at 30 s it was 4.0 m up and 5.0 m from the marker. " in why(moving)
    lands = tuple(dataclasses.replace(each, command="Land") for each in moving.steps)
    told = why(dataclasses.replace(moving, steps=lands))
    assert told.startswith("it commanded a landing at 5.0 s; at 30 s it was ")


@pytest.mark.parametrize(
    ("subject", "words"),
    [
        (
            flight("gave_up", (0.0, 0.0, 8.0), events=GAVE_UP),
            "it gave up at 12.0 s, 9.8 m up and 0.0 m from the marker. ",
        ),
        (
            flight("landed", (5.0, 0.0, 0.2), touchdown=touchdown(5.0)),
            "it landed 5.0 m off the marker, on open ground. The marker could be read in none",
        ),
        (
            flight("collision", (3.0, 0.0, 4.0), contacts=hit("tree-3", "tree", "static")),
            "it hit tree-3 at 2.5 m/s, 3.8 m up, 3.0 m east of the marker.",
        ),
    ],
)
def test_other_ends_are_told_as_their_verdict_does(subject: Flight, words: str) -> None:
    assert why(subject).startswith(words)
