from __future__ import annotations

import pytest

from pytest_garl.verdicts.wording import headline

PLACE = "At 32.7 s the UAV was 1.4 m up, over the marker."


@pytest.mark.parametrize(
    ("description", "expected"),
    [
        (
            "Collided with person-2 at 2.6 m/s. The camera had it in view within the last 2 s. "
            f"{PLACE} In the 2 s before 7 % of the marker was hidden or out of the frame.",
            "collided with person-2 at 2.6 m/s, 1.4 m up, over the marker",
        ),
        (
            f"The landing system raised: IndexError: list index. Out of range. {PLACE}",
            "Python error IndexError: list index. Out of range (1.4 m up, over the marker)",
        ),
        (
            f"The landing system returned nonsense: BadCommand: step returned 3. {PLACE}",
            "the landing system returned nonsense: BadCommand: step returned 3 (1.4 m up, over the "
            "marker)",
        ),
        (
            "Landed 3.0 m off the marker, on open ground; the marker had been in view; its target "
            f"was decoy-1. {PLACE}",
            "landed 3.0 m off the marker, on open ground",
        ),
        (
            "Came down 4.2 m north of the marker, which had never been readable, then hit tree-3 "
            "at 1.2 m/s. At 30.1 s the UAV was 1.6 m up, 4.1 m north of the marker.",
            "came down 4.2 m north of the marker, which had never been readable, then hit tree-3 "
            "at 1.2 m/s, 1.6 m up",
        ),
        (
            f"Gave up at 32.7 s for want of time; the marker was last readable at 22.3 s. {PLACE}",
            "gave up at 32.7 s for want of time, 1.4 m up, over the marker; the marker was last "
            "readable at 22.3 s",
        ),
        (
            "Not landed; the marker was never detected. "
            "At 120.0 s the UAV was 9.1 m up, 4.0 m east of the marker.",
            "not landed, 9.1 m up, 4.0 m east of the marker; the marker was never detected",
        ),
        ("The landing system hung: step took 10 s.", "the landing system hung: step took 10 s"),
        (f"Landed after 21.3 s. {PLACE}", "landed after 21.3 s, 1.4 m up, over the marker"),
        ("", ""),
    ],
)
def test_headline_shortens_a_description_to_half_a_line(description: str, expected: str) -> None:
    assert headline(description) == expected
