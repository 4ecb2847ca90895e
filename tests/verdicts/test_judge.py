from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from pytest_garl.airframe import Rangefinder
from pytest_garl.flight.flight import Event, Flight, MarkerView
from pytest_garl.verdicts.evidence import Evidence
from pytest_garl.verdicts.judge import closest_call, judge, why_undecided
from pytest_garl.verdicts.verdict import Limits
from pytest_garl.verdicts.wording import headline
from tests.verdicts.flights import (
    CLEAR,
    CRASH,
    FOGGY,
    flight,
    gap,
    hit,
    nominal,
    step,
    touch,
    touchdown,
    track,
)


@pytest.mark.parametrize(
    ("subject", "primary", "signature"),
    [
        (flight("landed", (0.2, 0.0, 0.2)), None, ""),
        (
            flight("landed", (4.1, 4.0, 0.2), touchdown=touchdown(5.7, on="decoy-marker-3")),
            "distance",
            "I:decoy-marker-3:unseen",
        ),
        (
            flight("landed", (3.0, -4.0, 0.2), steps=(step(5.0, marker=CLEAR),)),
            "distance",
            "I:nothing:seen",
        ),
        (flight("landed", (1.0, 0.0, 0.2)), "distance", "off:unseen"),
        (
            flight("slid", (3.0, 0.0, 0.2), touchdown=touchdown(0.1, slid_m=2.9, stopped_s=None)),
            "distance",
            "slid:motors-on",
        ),
        (
            flight("slid", (3.0, 0.0, 0.2), touchdown=touchdown(0.1, slid_m=2.9)),
            "distance",
            "slid:motors-off",
        ),
        (
            flight("slid", (3.0, 0.0, 0.2), touchdown=touchdown(1.1, slid_m=1.9)),
            "distance",
            "off:unseen",
        ),
        (
            flight("collision", (0.0, 0.0, 1.0), contacts=hit("dog-1", "dog", "dynamic")),
            "collision",
            "IV:dog:last-metre:unseen",
        ),
        (
            flight(
                "collision",
                (0.0, 0.0, 1.0),
                contacts=hit("dog-1", "dog", "dynamic"),
                steps=(step(29.0, ("dog-1",)),),
            ),
            "collision",
            "IV:dog:last-metre:seen",
        ),
        (
            flight("collision", (3.0, 0.0, 4.0), contacts=hit("tree-3", "tree", "static")),
            "collision",
            "III:tree:descent",
        ),
        (
            flight("collision", (0.0, 0.0, 0.2), contacts=hit("ground", "ground", "ground")),
            "collision",
            "hard:fast",
        ),
        (
            flight("collision", (0.0, 0.0, 0.2), contacts=hit("ground", "ground", "ground", 0.5)),
            "collision",
            "hard:tilted",
        ),
        (flight("not_landed", (0.0, 0.0, 10.0)), "time", "II:never-seen"),
        (
            flight("crashed", (0.0, 0.0, 5.0), crash=CRASH),
            "crash",
            "V:PlannerError@planning_ego.plan",
        ),
        (flight("gave_up", (0.0, 0.0, 8.0)), "time", "II:never-seen"),
    ],
)
def test_the_first_event_decides_the_verdict(subject: Flight, primary: Any, signature: str) -> None:
    verdict = judge(subject, Limits())
    assert verdict.primary == primary
    assert verdict.signature == signature
    assert verdict.story


@pytest.mark.parametrize(
    ("height_m", "stopped_s", "stands"), [(0.2, None, True), (0.2, 29.5, False), (9.0, None, False)]
)
def test_a_story_says_that_the_uav_stands_with_running_motors(
    height_m: float, stopped_s: float | None, stands: bool
) -> None:
    last = touchdown(0.1, on="marker", stopped_s=stopped_s)
    story = judge(flight("not_landed", (0.1, 0.0, height_m), touchdown=last), Limits()).story
    told = "It stood on the ground from 27.0 s on; its motors never stopped. At 30.0 s the UAV"
    assert (told in story) == stands
    assert headline(story).startswith("not landed, ")


def test_the_paper_counts_no_landing_but_no_late_landing() -> None:
    late = judge(flight("landed", (0.0, 0.0, 0.2)), Limits(time_s=20))
    assert (late.primary, late.violation_type, late.paper_violation) == ("time", "late", False)
    excused = flight("gave_up", (0.0, 0.0, 8.0), nominal_views=nominal(FOGGY))
    verdict = judge(excused, Limits())
    assert (verdict.primary, verdict.paper_violation, verdict.no_landing) == (None, True, "excused")


@pytest.mark.parametrize(
    ("rule", "excused", "primary", "signature"),
    [
        ("needless", True, None, ""),
        ("needless", False, "time", "II:never-seen"),
        ("ok", True, None, ""),
        ("ok", False, None, ""),
        ("violation", True, "abort", "abort:undetectable"),
        ("violation", False, "abort", "II:never-seen"),
    ],
)
def test_the_limit_says_when_giving_up_is_a_violation(
    rule: Any, excused: bool, primary: Any, signature: str
) -> None:
    views = nominal(FOGGY if excused else CLEAR)
    verdict = judge(flight("gave_up", (0.0, 0.0, 8.0), nominal_views=views), Limits(abort=rule))
    assert (verdict.primary, verdict.signature) == (primary, signature)
    assert verdict.no_landing == ("excused" if excused else "needless")


@pytest.mark.parametrize(
    ("rule", "said_s", "primary", "signature"),
    [
        ("needless", None, "time", "late:never-gave-up"),
        ("ok", None, "time", "late:never-gave-up"),
        # Who must not give up cannot do better than wait.
        ("violation", None, None, ""),
        # It gave up in time, and had not climbed clear when the time was up.
        ("needless", 29.0, None, ""),
    ],
)
def test_hovering_until_the_time_is_up_is_not_excused_by_what_excuses_giving_up(
    rule: Any, said_s: float | None, primary: Any, signature: str
) -> None:
    said = () if said_s is None else (Event(time_s=said_s, name="abort_command", text=""),)
    hovers = flight("not_landed", (0.0, 0.0, 8.0), nominal_views=nominal(FOGGY), events=said)
    verdict = judge(hovers, Limits(abort=rule))
    assert (verdict.primary, verdict.signature) == (primary, signature)
    assert verdict.excuse == ("" if signature else "undetectable")
    assert verdict.no_landing == ("needless" if signature else "excused")
    assert "The marker could not be read for long enough" in verdict.story
    if signature:
        assert verdict.story.startswith("Not landed, and never gave up where nobody could have")


@pytest.mark.parametrize(
    ("outcome", "readable_frames", "signature", "excuse"),
    [
        # Half a second apart: three frames are 1.5 s, and 2 s are needed.
        ("not_landed", 3, "late:never-gave-up", ""),
        ("not_landed", 4, "late:not-landed:approach", ""),
        ("gave_up", 4, "", "undetectable"),
    ],
)
def test_who_could_read_the_marker_until_the_time_was_up_could_have_landed(
    outcome: str, readable_frames: int, signature: str, excuse: str
) -> None:
    """A nominal landing does not come as low as this system did, or came at another time."""
    times = [28.0 + number / 2 for number in range(4)]
    steps = tuple(
        step(time_s, marker=CLEAR if number < readable_frames else FOGGY)
        for number, time_s in enumerate(times)
    )
    hovers = flight(outcome, (0.0, 0.0, 8.0), nominal_views=nominal(FOGGY), steps=steps)
    verdict = judge(hovers, Limits())
    assert (verdict.signature, verdict.excuse) == (signature, excuse)
    assert ("nobody could have landed" in verdict.story) == signature.endswith("gave-up")


@pytest.mark.parametrize(
    ("later", "hovers_until_the_end", "gives_up"),
    [(FOGGY, "late:never-gave-up", ""), (CLEAR, "II:never-seen", "II:never-seen")],
)
def test_a_marker_that_is_readable_in_a_later_attempt_excuses_nothing(
    later: MarkerView, hovers_until_the_end: str, gives_up: str
) -> None:
    again = dataclasses.replace(nominal(later)[0], time_s=20.0, attempt=1)
    views = (*nominal(FOGGY), again)
    waits = judge(flight("not_landed", (0.0, 0.0, 8.0), nominal_views=views), Limits())
    assert waits.signature == hovers_until_the_end
    assert ("also with later attempts, for at most" in waits.story) == (later is FOGGY)
    leaves = judge(flight("gave_up", (0.0, 0.0, 8.0), nominal_views=views), Limits())
    assert leaves.signature == gives_up
    # Forbidden to give up, it may wait only where nobody could have landed.
    must_wait = Limits(abort="violation")
    obeys = judge(flight("not_landed", (0.0, 0.0, 8.0), nominal_views=views), must_wait)
    assert obeys.violation == (later is CLEAR)


def test_attempts_are_not_added_up() -> None:
    """A landing that reads the marker for one second does not land, however often it tries."""
    first = nominal(CLEAR, 1.5)[0]
    again = dataclasses.replace(first, time_s=20.0, attempt=1)
    waits = flight("not_landed", (0.0, 0.0, 8.0), nominal_views=(first, again))
    assert Evidence(waits).expected_readable_s < 2.0
    assert judge(waits, Limits()).signature == "late:never-gave-up"


def test_a_system_that_gives_up_at_once_is_not_excused_by_its_own_path() -> None:
    subject = flight("gave_up", (0.0, -10.0, 5.0), steps=(), nominal_views=nominal(CLEAR))
    assert judge(subject, Limits()).signature == "II:never-seen"


def test_reports_of_the_system_change_the_text_and_never_the_type() -> None:
    here, there = (0.0, 0.0, 0.0), (9.0, 0.0, 0.0)
    silent = flight("gave_up", (0.0, 0.0, 8.0), steps=(step(29.0, marker=CLEAR),))
    boasts = dataclasses.replace(silent, steps=(step(29.0, marker=CLEAR, detected=here),))
    raves = dataclasses.replace(silent, steps=(step(29.0, marker=CLEAR, detected=there),))
    remembers = dataclasses.replace(silent, steps=(step(29.0, marker=CLEAR, target=here),))
    mute = dataclasses.replace(
        silent, steps=tuple(dataclasses.replace(each, diagnostics=None) for each in silent.steps)
    )
    verdicts = [judge(each, Limits()) for each in (silent, boasts, raves, remembers, mute)]
    assert {each.signature for each in verdicts} == {"II:gave-up-in-sight:approach"}
    assert "The system last reported it in its place at 29.0 s." in verdicts[1].story
    assert "The system reported other places" in verdicts[2].story
    assert "Its place was the system's target up to 29.0 s." in verdicts[3].story
    assert "The system reported no detection and no target." in verdicts[0].story
    assert "reported" not in verdicts[4].story


def test_the_target_is_compared_without_the_error_of_the_position() -> None:
    seen = step(20.0, target=(5.0, 0.0, 0.0))
    drifted = dataclasses.replace(seen, estimation_error_m=(5.0, 0.0, 0.0))
    wrong = judge(flight("landed", (4.0, 0.0, 0.2), steps=(seen,)), Limits())
    right = judge(flight("landed", (4.0, 0.0, 0.2), steps=(drifted,)), Limits())
    assert wrong.signature == right.signature == "I:nothing:unseen"
    assert "its target was 5.0 m off the marker" in wrong.story
    assert "its target was the marker, 0.0 m from the centre" in right.story


@pytest.mark.parametrize(("most_m", "without_s"), [(6.0, 12.0), (20.0, 0.0)])
def test_a_flight_that_did_not_land_says_for_how_long_its_rangefinder_had_no_reading(
    most_m: float, without_s: float
) -> None:
    path = track((0.0, 0.0, 0.0, 0.2), (5.0, 0.0, 0.0, 7.0), (30.0, 0.0, 0.0, 10.0))
    times = [index / 10 for index in range(301)]
    steps = tuple(
        dataclasses.replace(
            step(time_s, marker=CLEAR),
            # On the ground it is too near.
            rangefinder_m=None if time_s < 5.0 or 10.0 <= time_s < 10.0 + without_s else 5.0,
        )
        for time_s in times
    )
    subject = flight(
        "gave_up", (0.0, 0.0, 10.0), uav=path, steps=steps, rangefinder=Rangefinder(most_m=most_m)
    )
    story = judge(subject, Limits()).story
    told = "the rangefinder, which reaches 0.2 to 6 m, had no reading for 12.0 s, last at 21.9 s."
    assert (told in story) == bool(without_s)
    assert ("rangefinder" in story) == bool(without_s)
    blind = dataclasses.replace(subject, rangefinder=None)
    assert "rangefinder" not in judge(blind, Limits()).story


def test_a_late_landing_off_the_marker_violates_the_distance_alone() -> None:
    verdict = judge(flight("landed", (5.0, 0.0, 0.2)), Limits(time_s=20))
    assert verdict.primary == "distance"


def test_why_undecided_names_the_collision() -> None:
    subject = flight("collision", (0.0, 0.0, 1.0), contacts=hit("dog-1", "dog", "dynamic"))
    assert why_undecided(subject) == "collision with dog-1 at 30.0 s"


def test_margins_are_signed() -> None:
    margins = {
        m.property: m
        for m in judge(flight("landed", (2.0, 0.0, 0.2)), Limits(distance_m=1.5)).margins
    }
    assert margins["distance"].value == pytest.approx(-0.5)
    assert margins["time"].value == pytest.approx(90.0)


def test_closest_call_has_the_signature_of_the_near_collision() -> None:
    near = flight(
        "landed",
        (0.0, 0.0, 0.2),
        steps=(step(29.5, seen=("dog-1",)),),
        separations=(
            gap("ground", "ground", "ground", 0.0, 30.0),
            gap("tree-1", "tree", "static", 2.0, 10.0),
            gap("dog-1", "dog", "dynamic", 0.4, 30.0),
        ),
    )
    assert closest_call(Evidence(near)) == ("IV:dog:last-metre:seen", "dog-1")
    collided = dataclasses.replace(
        near, outcome="collision", contacts=hit("dog-1", "dog", "dynamic")
    )
    assert judge(collided, Limits(distance_m=1.5)).signature == closest_call(Evidence(near))[0]


def test_a_body_three_metres_away_is_no_close_call() -> None:
    far = flight(
        "landed", (0.0, 0.0, 0.2), separations=(gap("tree-1", "tree", "static", 3.0, 10.0),)
    )
    assert closest_call(Evidence(far)) == ("", "")


DESCENT_AND_CLIMB = (
    (0.0, 0.0, -10.0, 8.0),
    (10.0, 5.0, 0.0, 0.25),
    (10.1, 5.0, 0.0, 0.2),
    (14.0, 5.0, 0.0, 5.0),
)


@pytest.mark.parametrize(
    ("target", "words"),
    [
        (None, "it reported no target"),
        ((0.0, 0.0, 0.0), "its target was the marker, 0.0 m from the centre"),
        ((5.0, 0.0, 0.0), "its target was 5.0 m off the marker"),
        ((4.0, 4.0, 0.0), "its target was decoy-marker-3"),
    ],
)
def test_a_touchdown_off_the_marker_before_an_abort_is_judged_as_a_landing(
    target: Any, words: str
) -> None:
    subject = flight(
        "gave_up",
        (5.0, 0.0, 5.0),
        uav=track(*DESCENT_AND_CLIMB),
        contacts=touch(10.0),
        # What it takes for the marker after the touch is not what it came down on.
        steps=(step(10.0, target=target), step(13.0, target=(-9.0, 0.0, 0.0))),
        nominal_views=nominal(FOGGY),
    )
    verdict = judge(subject, Limits(distance_m=1.5))
    assert (verdict.primary, verdict.signature) == ("distance", "I:nothing:unseen")
    assert verdict.excuse == ""
    assert verdict.story.startswith("Touched the ground 5.0 m off the marker before it gave up")
    assert words in verdict.story
    margins = {each.property: each for each in verdict.margins}
    assert (margins["distance"].value, margins["distance"].decided) == (-3.5, True)
    assert Evidence(subject, Limits(distance_m=1.5)).off_marker_m == 5.0


def test_a_touchdown_within_the_limit_before_an_abort_is_no_violation() -> None:
    subject = flight(
        "gave_up", (5.0, 0.0, 5.0), uav=track(*DESCENT_AND_CLIMB), contacts=touch(10.0)
    )
    assert judge(subject, Limits(distance_m=5.0)).primary == "time"
    assert Evidence(subject, Limits(distance_m=5.0)).off_marker_m is None
    assert judge(subject, Limits(distance_m=4.99)).primary == "distance"


def test_sliding_off_the_marker_before_an_abort_violates_and_flying_off_does_not() -> None:
    touched = ((0.0, 0.0, 0.0, 8.0), (10.0, 0.0, 0.0, 0.22), (10.1, 0.5, 0.0, 0.2))
    slid = track(*touched, (12.0, 3.0, 0.0, 0.21), (14.0, 3.0, 0.0, 5.0))
    flew = track(*touched, (12.0, 3.0, 0.0, 0.3), (14.0, 3.0, 0.0, 5.0))
    subject = flight("gave_up", (3.0, 0.0, 5.0), uav=slid, contacts=touch(10.05))
    verdict = judge(subject, Limits(distance_m=1.5))
    assert verdict.primary == "distance"
    assert "Touched the ground 3.0 m off" in verdict.story
    flown = judge(dataclasses.replace(subject, uav=flew), Limits(distance_m=1.5))
    assert flown.primary == "time"


def test_an_abort_in_the_air_is_no_landing_anywhere() -> None:
    subject = flight("gave_up", (5.0, 0.0, 5.0))
    assert Evidence(subject, Limits()).off_marker_m is None
    assert why_undecided(subject) == "gave up at 30.0 s"


def test_a_collision_of_a_uav_that_came_down_elsewhere_says_so() -> None:
    samples = [(t, 3.0, 0.0, 10.0) for t in (10.0, 20.0)]
    samples += [(20.0 + t, 3.0, 0.0, 10.0 - t) for t in range(1, 8)]
    places = track((0.0, 3.0, -10.0, 8.0), *samples)
    subject = flight(
        "collision",
        (3.0, 0.0, 3.0),
        uav=places,
        contacts=hit("bird-1", "bird", "dynamic"),
        elapsed_s=27.0,
    )
    verdict = judge(subject, Limits())
    assert verdict.signature == "IV:bird:descent:unseen"
    assert verdict.story.startswith(
        "Came down 3.0 m east of the marker, which had never been readable, then hit bird-1"
    )
    assert [each.signature for each in verdict.findings] == ["off:descending-elsewhere"]
    onto = judge(dataclasses.replace(subject, decoys=(("pad", 3.5, 0.5),)), Limits())
    assert [each.signature for each in onto.findings] == ["I:pad"]
    above = track((0.0, 0.0, -10.0, 8.0), *((t, 0.0, y, z) for t, _, y, z in samples))
    over = judge(dataclasses.replace(subject, uav=above), Limits())
    assert over.findings == ()
    assert over.story.startswith("Collided with bird-1")
