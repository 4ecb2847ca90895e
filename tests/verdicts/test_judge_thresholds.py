"""Each threshold of the judge from both sides."""

from __future__ import annotations

import math
from typing import Any

import pytest

from pytest_garl.flight.flight import Flight
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import Limits
from tests.verdicts.flights import (
    CLEAR,
    FOGGY,
    flight,
    hit,
    nominal,
    person_at,
    step,
    touchdown,
    track,
)


@pytest.mark.parametrize(("distance_m", "violated"), [(1.5, False), (1.501, True)])
def test_paper_violation_begins_beyond_1_5_m(distance_m: float, violated: bool) -> None:
    verdict = judge(flight("landed", (distance_m, 0.0, 0.2)), Limits(distance_m=4.0))
    assert verdict.paper_violation is violated
    assert verdict.primary is None


@pytest.mark.parametrize(("limit_m", "primary"), [(3.0, None), (2.999, "distance")])
def test_a_landing_at_the_limit_of_distance_is_no_violation(limit_m: float, primary: Any) -> None:
    verdict = judge(flight("landed", (3.0, 0.0, 0.2)), Limits(distance_m=limit_m))
    assert verdict.primary == primary


@pytest.mark.parametrize(("limit_s", "primary"), [(30.0, None), (29.999, "time")])
def test_a_landing_at_the_limit_of_time_is_no_violation(limit_s: float, primary: Any) -> None:
    assert judge(flight("landed", (0.0, 0.0, 0.2)), Limits(time_s=limit_s)).primary == primary


@pytest.mark.parametrize(("tilt_deg", "signature"), [(20.0, "hard:fast"), (20.1, "hard:tilted")])
def test_a_touchdown_beyond_twenty_degrees_is_tilted(tilt_deg: float, signature: str) -> None:
    contacts = hit("ground", "ground", "ground", math.radians(tilt_deg))
    subject = flight("collision", (0.0, 0.0, 0.2), contacts=contacts)
    assert judge(subject, Limits(distance_m=1.5)).signature == signature


@pytest.mark.parametrize(
    ("off_m", "signature"), [(0.75, ""), (0.76, "off:unseen"), (1.5, "off:unseen")]
)
def test_a_landing_up_to_1_5_m_off_is_off(off_m: float, signature: str) -> None:
    subject = flight("landed", (off_m, 0.0, 0.2), touchdown=touchdown(off_m))
    assert judge(subject, Limits()).signature == signature


def test_a_landing_beyond_1_5_m_is_on_something_else() -> None:
    subject = flight("landed", (1.51, 0.0, 0.2), touchdown=touchdown(1.51, on="line"))
    assert judge(subject, Limits()).signature == "I:line:unseen"


def test_a_limit_beyond_1_5_m_moves_the_border_of_type_i() -> None:
    subject = flight("landed", (3.1, 0.0, 0.2), touchdown=touchdown(3.1))
    assert judge(subject, Limits(distance_m=3.0)).violation_type == "I"
    assert judge(subject, Limits(distance_m=3.1)).primary is None


@pytest.mark.parametrize(("away_m", "what"), [(1.5, "decoy-b"), (1.51, "nothing")])
def test_without_a_touchdown_the_nearest_decoy_within_1_5_m_lies_under_the_uav(
    away_m: float, what: str
) -> None:
    decoys = (("decoy-a", 4.0, 6.0), ("decoy-b", 4.0 + away_m, 4.0))
    subject = flight("landed", (4.0, 4.0, 0.2), decoys=decoys)
    assert judge(subject, Limits()).signature == f"I:{what}:unseen"


@pytest.mark.parametrize(("seen_s", "sight"), [(24.0, "seen"), (23.9, "unseen")])
def test_a_marker_readable_in_the_last_three_seconds_was_seen(seen_s: float, sight: str) -> None:
    subject = flight(
        "landed",
        (1.0, 0.0, 0.2),
        steps=(step(seen_s, marker=CLEAR),),
        touchdown=touchdown(1.0, time_s=27.0),
    )
    assert judge(subject, Limits()).signature == f"off:{sight}"


@pytest.mark.parametrize(
    ("last_s", "signature", "words"),
    [
        (
            27.0,
            "late:not-landed:approach",
            "was in view: readable in 67 % of the pictures of the last 30 s",
        ),
        (26.9, "II:lost:approach", "the marker was last readable at 26.9 s"),
    ],
)
def test_a_marker_not_readable_for_three_seconds_is_lost(
    last_s: float, signature: str, words: str
) -> None:
    steps = (step(5.0, marker=CLEAR), step(last_s, marker=CLEAR), step(29.9, marker=FOGGY))
    verdict = judge(flight("not_landed", (0.0, 0.0, 10.0), steps=steps), Limits())
    assert verdict.signature == signature
    assert words in verdict.story


@pytest.mark.parametrize(
    ("last_s", "top_m", "words"),
    [
        (25.0, 3.0, "at 2.5 m/s, climbing. The marker was last readable at 25.0 s, 1.0 m up."),
        (25.0, 1.02, "at 2.5 m/s. The marker was last readable at 25.0 s, 1.0 m up."),
        (27.0, 3.0, "at 2.5 m/s, climbing. At 30.0 s"),
    ],
)
def test_the_story_of_a_tree_says_when_the_marker_was_lost_and_whether_the_uav_climbed(
    last_s: float, top_m: float, words: str
) -> None:
    subject = flight(
        "collision",
        (0.0, 0.0, top_m),
        contacts=hit("tree-1", "tree", "static"),
        uav=track(
            (0.0, 0.0, 0.0, 10.0), (24.0, 0.0, 0.0, 1.0), (29.9, 0.0, 0.0, 1.0), (30.0, 0, 0, top_m)
        ),
        steps=(step(last_s, marker=CLEAR), step(29.9, marker=FOGGY)),
    )
    assert words in judge(subject, Limits()).story


@pytest.mark.parametrize(("lowest_m", "told"), [(0.4, True), (9.1, False)])
def test_the_story_of_a_flight_without_landing_says_how_low_it_had_been(
    lowest_m: float, told: bool
) -> None:
    subject = flight(
        "not_landed",
        (0.0, 0.0, 10.0),
        uav=track(
            (0.0, 0.0, -10.0, 10.0), (10.0, 0, 0, 10.0), (20.0, 0, 0, lowest_m), (30.0, 0, 0, 10.0)
        ),
        steps=(step(29.0, marker=CLEAR), step(29.9, marker=CLEAR)),
    )
    words = "to the end. It had come down to 0.4 m by 20.0 s, and climbed again."
    assert (words in judge(subject, Limits()).story) == told


@pytest.mark.parametrize(
    ("limit_s", "signature"),
    [(36.0, "II:gave-up-in-sight:approach"), (35.0, "late:no-time:approach")],
)
def test_giving_up_in_the_last_15_percent_of_the_time_is_for_want_of_time(
    limit_s: float, signature: str
) -> None:
    steps = (step(29.0, marker=CLEAR), step(29.1, marker=CLEAR))
    subject = flight("gave_up", (0.0, 0.0, 10.0), steps=steps)
    assert judge(subject, Limits(time_s=limit_s)).signature == signature


@pytest.mark.parametrize(
    ("visible", "kind", "words"),
    [
        (0.51, "late", "although the marker was in view to the end"),
        (0.5, "II", "the marker was never readable"),
    ],
)
def test_without_records_of_the_marker_its_visible_share_counts(
    visible: float, kind: str, words: str
) -> None:
    steps = (step(29.9, visible=visible),)
    verdict = judge(flight("not_landed", (0.0, 0.0, 10.0), steps=steps), Limits())
    assert verdict.violation_type == kind
    assert words in verdict.story


@pytest.mark.parametrize(("duration_s", "excuse"), [(1.9, "undetectable"), (2.4, "")])
def test_a_marker_that_a_nominal_landing_reads_for_two_seconds_excuses_nobody(
    duration_s: float, excuse: str
) -> None:
    subject = flight("gave_up", (0.0, 0.0, 8.0), nominal_views=nominal(CLEAR, duration_s))
    verdict = judge(subject, Limits())
    assert verdict.excuse == excuse
    assert (verdict.primary is None) == bool(excuse)


def _blocked(times: tuple[float, ...], xs: tuple[float, ...], arrival_s: float) -> Flight:
    return flight(
        "gave_up",
        (0.0, 0.0, 8.0),
        uav=track(*((time, 0.0, 0.0, 8.0) for time in times)),
        objects=(person_at(times, xs),),
        nominal_arrival_s=arrival_s,
        elapsed_s=times[-1],
    )


@pytest.mark.parametrize(
    ("away_s", "arrival_s", "excuse"),
    [
        (9, 10.0, "blocked"),
        (11, 10.0, ""),  # free for ten seconds
        (0, 40.0, ""),  # less than half a minute of waiting
    ],
)
def test_a_marker_that_is_never_free_for_ten_seconds_is_blocked(
    away_s: int, arrival_s: float, excuse: str
) -> None:
    times = tuple(float(second) for second in range(61))
    xs = tuple(9.0 if 20 <= second < 20 + away_s else 0.5 for second in range(61))
    verdict = judge(_blocked(times, xs, arrival_s), Limits())
    assert verdict.excuse == excuse
    assert ("was blocked" in verdict.story) == bool(excuse)


@pytest.mark.parametrize(("time_s", "sight"), [(28.0, "seen"), (27.9, "unseen"), (30.1, "unseen")])
def test_an_object_in_view_up_to_two_seconds_before_was_seen(time_s: float, sight: str) -> None:
    subject = flight(
        "collision",
        (0.0, 0.0, 1.0),
        contacts=hit("dog-1", "dog", "dynamic"),
        steps=(step(time_s, ("dog-1",)),),
    )
    assert judge(subject, Limits(distance_m=1.5)).signature.endswith(f":{sight}")
