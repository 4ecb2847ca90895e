"""Text for reports: a flight in half a line, compass points."""

from __future__ import annotations

import math
import re

from pytest_garl.verdicts.verdict import Limits

_WHERE = re.compile(
    r"(?P<what>.*?)\.?\s+At [\d.]+ s the UAV was (?P<where>.+?)\.(?: In the 2 s before .*)?",
    re.DOTALL,
)
_POINTS = (
    "east",
    "north-east",
    "north",
    "north-west",
    "west",
    "south-west",
    "south",
    "south-east",
)
_TOUCHDOWN_DETAIL = re.compile(r"; (?:the marker (?:had|was)|its target|it reported) ")
"""Where the detail of a touchdown off the marker begins."""
_CRASH = "The landing system "
_RAISED = f"{_CRASH}raised: "


def limits_text(limits: Limits) -> str:
    """Return such as ``distance 0.75 m, time 120 s, abort="needless"``."""
    return f'distance {limits.distance_m:g} m, time {limits.time_s:g} s, abort="{limits.abort}"'


def headline(description: str) -> str:
    """Shorten a verdict's description to half a line.

    Example: ``collided with person-2 at 2.6 m/s, 1.4 m up, over the marker``, or ``gave up at
    45.2 s, 9.8 m up, over the marker; the marker was never well readable``.
    """
    found = _WHERE.fullmatch(description.strip())
    what, where = (found["what"], f", {found['where']}") if found else (description.strip(), "")
    if what.startswith(_RAISED):
        what = f"Python error {what.removeprefix(_RAISED)}"
    elif not what.startswith(_CRASH):
        # A landing system's message may hold anything; our own sentences end with a full stop.
        what = re.split(r"(?<=[a-z\d%])\. (?=[A-Z])", what)[0]
        if " off the marker" in what:
            # The sentence says where the UAV came down.
            what, where = _TOUCHDOWN_DETAIL.split(what)[0], ""
        elif " of the marker" in what:
            where = where.rpartition(", ")[0]
    what = what.partition("\n")[0].removesuffix(".")
    if what.startswith(("Python", _CRASH)):
        # An exception's text may end in any words; the place must not seem to continue them.
        place = f" ({where.removeprefix(', ')})" if where else ""
        return f"{what[:1].lower() if what.startswith(_CRASH) else 'P'}{what[1:]}{place}"
    # The place is that of what happened, not of what had been before.
    happened, mark, before = what.partition("; ")
    return f"{happened[:1].lower()}{happened[1:]}{where}{mark}{before}"


def compass_point(east_m: float, north_m: float) -> str:
    """Return the compass point, of eight, that is nearest to the direction of an offset."""
    return _POINTS[round(math.atan2(north_m, east_m) / (math.pi / 4)) % 8]
