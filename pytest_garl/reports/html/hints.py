"""Where an engineer looks first, from the type of a violation and what the record shows.

A landing system that reports neither detections nor a target is not judged by what it saw: nobody
knows.  The hints then say what was commanded and where the UAV flew, and how to report a target.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator

import numpy as np

from pytest_garl.cases.case import NOT_ASKED, Prevention
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.thresholds import feet_height_m
from pytest_garl.reports.html.sightings_text import readable_and_reported
from pytest_garl.verdicts.evidence import Evidence
from pytest_garl.verdicts.verdict import Verdict

AT_MARKER_M = 1.0
"""A target no farther than this from the marker's centre is meant for the marker."""
FLYING_M = 0.5
"""Below this height of its feet a UAV has not taken off yet, or has landed."""
MISSED = 0.5
"""A system that reports fewer of the readable frames than this share has lost the marker."""


def hints_of(
    evidence: Evidence | None, verdict: Verdict, prevention: Prevention = NOT_ASKED
) -> tuple[str, ...]:
    """Return one or two sentences; none for an assertion of the user's own."""
    kind = verdict.violation_type
    if evidence and evidence.holds:
        # The hints speak of a landing.
        return ()
    if kind == "IV":
        return (_moving(evidence.flight if evidence else None, prevention),)
    if kind in ("II", "abort") or verdict.signature.startswith("late:not-landed"):
        return tuple(_not_landed(evidence)) if evidence else ()
    if kind == "V":
        return _crashed(verdict)
    if verdict.cause in _OF_CAUSE:
        return _OF_CAUSE[verdict.cause]
    decoy = next((name for name in _signatures(verdict) if name.startswith(_DECOY)), "")
    if decoy:
        name = decoy.split(":")[1].removeprefix("decoy-")
        way = "It came down on" if kind == "I" else "It was coming down to"
        first = _decoy(evidence, f"{way} a decoy, {name}")
        return (first,) if kind == "I" else (first, *_OF_TYPE.get(kind or "", ()))
    if kind in ("I", "off"):
        return (_elsewhere(evidence),)
    return _OF_TYPE.get(kind or "", ())


_DECOY = "I:decoy-"
_OF_CAUSE = {
    "late:standing": (
        "The UAV stood on the ground: look at how the system notices a touchdown, and at when it "
        "stops the motors.",
    ),
    "late:never-gave-up": (
        "Nobody could have landed: look at when the system gives up; `mission.time_limit_s` says "
        "how much time it has.",
    ),
}
_OF_TYPE = {
    "III": (
        "A body that does not move was hit: look at the way that the system took there, and "
        "at its clearance from what it could see or knew.",
    ),
    "late": ("It was too slow: the charts below show where the UAV was, and for how long.",),
    "hard": ("Look at the descent of the last metres: speed and tilt at the touchdown.",),
    "slid": ("Look at the speed over the ground at the touchdown, and at when motors stop.",),
}


_OF_CRASH = (
    ("The landing system raised", "The traceback below names the line that failed."),
    ("The landing system returned nonsense", "Look at what the method returned just before."),
    (
        "The landing system died",
        "Its process ended without a Python exception: look at native code, memory and exits. What "
        "is known of it stands below.",
    ),
    (
        "The landing system hung",
        "A call did not return in time: look at loops and at what waits. Where it was then stands "
        "below.",
    ),
)
"""Hints for a crash, by how its story begins."""


def _crashed(verdict: Verdict) -> tuple[str, ...]:
    return tuple(hint for begin, hint in _OF_CRASH if verdict.story.startswith(begin))


def _signatures(verdict: Verdict) -> Iterator[str]:
    """Yield the signature of the event, and of what had gone wrong before it."""
    yield verdict.signature
    yield from (finding.signature for finding in verdict.findings)


def _decoy(evidence: Evidence | None, what: str) -> str:
    """Return what a descent to a decoy points to, and when the target became another one."""
    if evidence is None or not evidence.targets:
        return (
            f"{what}: look at how the system chooses the place to come down. It reported no target "
            "in this flight, so nothing tells whether it took the decoy for the marker. "
            f"{_patch(evidence)}"
        )
    text = f"{what}: look at how the system chooses among what it may take for the marker."
    marker = evidence.flight.marker_position_m
    right = [at_s for at_s, target in evidence.targets if math.dist(target, marker) < AT_MARKER_M]
    if not right:
        return f"{text} Its target was never the marker."
    return f"{text} Its target was last at the marker at {right[-1]:.1f} s."


def _moving(flight: Flight | None, prevention: Prevention) -> str:
    answer = prevention.answer
    if prevention.escape == "motors off":
        return (
            "The UAV stood on the ground with running motors: look at how the system notices a "
            "touchdown, and at when it stops the motors."
        )
    if answer == "preventable":
        return (
            "An escape existed after the camera could show the body: look at what the system does "
            "with something that comes into view, and at how low it still gives way."
        )
    if answer == "sensor-limited":
        return (
            "An escape existed, but the camera did not show the body in time for it: a wider view, "
            "a slower descent or another sensor would have been needed."
        )
    if answer == "unpreventable":
        return (
            "No landing system could have escaped: this is about the place and the procedure, not "
            "about the code."
        )
    if flight is None or not flight.contacts:
        return "Look at what the system does with something that comes near."
    contact = flight.contacts[-1]
    times = [step.time_s for step in flight.steps if contact.body in step.objects_visible]
    if not times:
        return (
            f"The camera never showed {contact.body}: look at the field of view and at the "
            "procedure, before the code."
        )
    first_s, last_s = (contact.time_s - each for each in (times[0], times[-1]))
    return (
        f"{contact.body} was in view for the first time {first_s:.1f} s before the contact, for "
        f"the last {last_s:.1f} s before it: look at what the system does with something that "
        "comes into view. Whether an escape existed was not asked for this flight."
    )


def _elsewhere(evidence: Evidence | None) -> str:
    """Return what a landing beside the marker points to, by the target that the system had."""
    target = evidence.last_target(evidence.decided_s) if evidence else None
    if evidence is None or target is None:
        return (
            "Look at how the system chooses the place to come down. It reported no target in this "
            "flight, so this page cannot tell a wrong target from a wrong way there. "
            f"{_patch(evidence)}"
        )
    flight, down = evidence.flight, evidence.decided_s
    off_m = math.dist(target, flight.marker_position_m)
    index = flight.uav.index_at(down)
    x, y = (float(value) for value in flight.uav.position_m[index, :2])
    missed_m = math.dist(target, (x, y))
    if off_m > missed_m:
        return (
            f"Its last target was {off_m:.1f} m off the marker, and the UAV came down "
            f"{missed_m:.1f} m from that target: look at the detector, the camera's calibration "
            "and the estimated position before the control."
        )
    return (
        f"Its last target was {off_m:.1f} m off the marker, but the UAV came down {missed_m:.1f} "
        "m from that target: look at the control of the descent, at wind, and at what the system "
        "does after it has lost sight of the marker."
    )


def _not_landed(evidence: Evidence) -> Iterator[str]:
    readable, reported = readable_and_reported(evidence)
    if not readable:
        yield (
            "The marker could not be read from where the UAV flew: look at where and how high the "
            "system searches, and for how long."
        )
    elif not evidence.reports_anything:
        yield from _nothing_reported(evidence, readable)
    elif reported < MISSED * readable and evidence.reports_detections:
        yield (
            f"The marker could be read in {readable} frames, and the system reported it in "
            f"{reported} of them: look at the detector under the conditions below."
        )
    elif reported < MISSED * readable:
        yield (
            f"The marker could be read in {readable} frames, and the system had a target at it in "
            f"{reported} of them. It reports no detections, so nothing tells whether it did not "
            "see the marker, or saw it and did not take it for its target: look at both."
        )
    elif evidence.reports_detections:
        yield (
            f"The system reported the marker in {reported} of {readable} readable frames: it is "
            f"not the detector. {_DECISION.format(evidence.decided_s)}"
        )
    else:
        # A target may be a memory: it is no sighting.
        yield (
            f"The system had a target at the marker in {reported} of {readable} readable frames, "
            "but reports no detections, so nothing tells whether it saw the marker. "
            f"{_DECISION.format(evidence.decided_s)}"
        )


_DECISION = (
    "Look at why the system did not descend, and at the decision to end the flight at {:.1f} s."
)


def _nothing_reported(evidence: Evidence, readable: int) -> Iterator[str]:
    """Yield what is known of a flight whose system reported neither detections nor a target."""
    yield (
        f"The marker could be read in {readable} frames. The system reported neither detections "
        "nor a target in this flight, so nothing tells whether it saw the marker. "
        f"{_path_at_marker(evidence)} {_commanded(evidence)}"
    )
    yield _patch(evidence)


def _path_at_marker(evidence: Evidence) -> str:
    """Return for how long the UAV was above the marker, and how low it came there."""
    track, end_s = evidence.flight.uav, evidence.decided_s
    marker = evidence.flight.marker_position_m
    away = np.hypot(track.position_m[:, 0] - marker[0], track.position_m[:, 1] - marker[1])
    heights = np.array([feet_height_m(float(z)) for z in track.position_m[:, 2]])
    counted = (track.time_s <= end_s) & (heights >= FLYING_M)
    if not counted.any():
        return "The UAV did not leave the ground."
    above = np.flatnonzero(counted & (away <= AT_MARKER_M))
    if not len(above):
        nearest = np.flatnonzero(counted)[int(np.argmin(away[counted]))]
        return (
            f"The UAV was never nearer than {away[nearest]:.1f} m to the marker, seen from above; "
            f"that was at {track.time_s[nearest]:.1f} s, {heights[nearest]:.1f} m up."
        )
    steps = np.diff(track.time_s, prepend=track.time_s[:1])
    lowest = above[int(np.argmin(heights[above]))]
    return (
        f"The UAV was within {AT_MARKER_M:g} m of the marker, seen from above, for "
        f"{float(steps[above].sum()):.1f} s, first at {track.time_s[above[0]]:.1f} s; there it was "
        f"{heights[lowest]:.1f} m up at the lowest, at {track.time_s[lowest]:.1f} s."
    )


def _commanded(evidence: Evidence) -> str:
    """Return whether the system ever commanded a landing, and how it ended the flight."""
    said_s = evidence.said_abort_s
    until = "" if said_s is None else f"; it gave up at {said_s:.1f} s"
    land = [step.time_s for step in evidence.flight.steps if step.command == "Land"]
    if not land:
        return f"It never commanded a landing{until}."
    return f"It commanded a landing in {len(land)} frames, first at {land[0]:.1f} s{until}."


def _patch(evidence: Evidence | None) -> str:
    """Return the line of code that would report a target, with the command that is used most."""
    used = Counter(step.command for step in (evidence.flight.steps if evidence else ()))
    for command in ("Land", "Abort"):
        used.pop(command, None)
    name = used.most_common(1)[0][0] if used else "PositionSetpoint"
    return (
        "To see its target here, return it with each command: "
        f"{name}(..., diagnostics=Diagnostics(target_m=(x, y, 0.0))), or from a program over stdin "
        '"diagnostics": {"target_m": [x, y, 0]}, where x, y is the place that your system takes '
        "for the marker. A program over MAVLink tells it by LANDING_TARGET."
    )
