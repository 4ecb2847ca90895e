"""Judge a flight: a pure function of the flight and the limits that returns a verdict."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pytest_garl.simulation.flight import Contact, Crash, Flight, Separation
from pytest_garl.simulation.physics.vehicle import up_m
from pytest_garl.simulation.system_under_test.texts import cut
from pytest_garl.verdicts.phases import (
    landing_phase,
    last_sighting_s,
    reports_detections,
    reports_targets,
    was_in_view,
)
from pytest_garl.verdicts.verdict import (
    PAPER_LIMITS,
    Limits,
    Margin,
    PropertyName,
    Verdict,
    ViolationType,
)
from pytest_garl.verdicts.wording import compass_point

ON_GROUND_M = 0.02
"""After its first contact with the ground, the UAV counts as on the ground up to this much above
its height at the contact, because it may rebound a little."""
LOST_AFTER_S = 3.0
"""A marker counts as lost if it was not seen for this long before the end."""
MESSAGE_CHARS = 300
"""Length of an exception's message in a description; the flight's record has 1,000 characters."""
SAME_PLACE_M = 1.5
"""A target and a decoy, or a target and the marker, within this distance are the same place: the
length of the marker's side."""
CLOSE_CALL_M = 3.0
"""A close call is within this distance; exact separations end here too."""
TILTED_RAD = math.radians(20)
"""A touchdown beyond this angle is called tilted."""
RECENT_S = 2.0
"""Length of the last part of a flight in which a hidden marker is described."""
LEAST_HIDDEN_SHARE = 0.01
"""A smaller hidden share of the marker is not described."""
OVER_MARKER_M = 0.3
"""A UAV within this horizontal distance is described as over the marker."""


def judge(flight: Flight, limits: Limits) -> Verdict:
    """Return the verdict: the first violation of the flight, or none.

    A touchdown off the marker before an abort is a violation, but not by the paper's definition,
    which measures the distance of landings only.
    """
    mechanism = _mechanism(flight, limits)
    far = flight.final_distance_m > PAPER_LIMITS.distance_m
    paper = (
        flight.outcome == "collision"
        or flight.outcome == "not_landed"
        or (flight.outcome == "landed" and far)
    )
    return Verdict(
        outcome=flight.outcome,
        primary=mechanism.primary,
        violation_type=mechanism.violation_type,
        signature=mechanism.signature,
        paper_violation=paper,
        margins=_margins(flight, limits),
        story=f"{mechanism.sentence} {_where(flight)}".strip(),
    )


def closest_call(flight: Flight) -> tuple[str, str]:
    """Return the signature of a collision with the nearest body, and that body's name.

    Both are empty if no body but the ground came within :data:`CLOSE_CALL_M`.
    """
    near = [
        gap
        for gap in flight.separations
        if gap.body_class != "ground" and gap.distance_m < CLOSE_CALL_M
    ]
    if not near:
        return "", ""
    nearest = min(near, key=lambda gap: (gap.distance_m, gap.body))
    return _collision_signature(flight, nearest), nearest.body


def why_undecided(flight: Flight) -> str:
    """Return the reason why distance and time were not decided; empty if they were."""
    if flight.outcome == "landed":
        return ""
    when = f"at {flight.elapsed_s:.1f} s"
    if flight.outcome == "collision":
        return f"collision with {flight.contacts[-1].body} {when}"
    if flight.outcome == "gave_up":
        return f"aborted {when}"
    if flight.outcome == "crashed":
        return f"the landing system crashed {when}"
    return f"not landed after {flight.elapsed_s:.0f} s"


def off_marker_m(flight: Flight, limits: Limits) -> float | None:
    """Return the distance from the marker at which the UAV came down; None if it did not.

    An aborted flight came down if it touched the ground beyond the limit, because it mistook
    another place for the marker.
    """
    if flight.outcome == "landed":
        return flight.final_distance_m
    touchdown = _touchdown_off_marker(flight, limits)
    return touchdown.distance_m if touchdown else None


@dataclass(frozen=True, slots=True)
class _Touchdown:
    """A touchdown away from the marker."""

    distance_m: float
    time_s: float


def _touchdown_off_marker(flight: Flight, limits: Limits) -> _Touchdown | None:
    """Return an aborted flight's first touchdown beyond the limit, or None.

    The record holds only the first contact with the ground; later ones follow from the height.
    """
    first = next((each for each in flight.contacts if each.body_class == "ground"), None)
    if flight.outcome != "gave_up" or first is None:
        return None
    track = flight.uav
    start = max(0, int(np.searchsorted(track.time_s, first.time_s, side="right")) - 1)
    # The sample before a contact lies above the ground, the one after it on the ground.
    height = float(track.position_m[start : start + 2, 2].min()) + ON_GROUND_M
    mx, my = flight.marker_position_m
    for index in range(start, len(track.time_s)):
        x, y, z = (float(value) for value in track.position_m[index])
        off = math.hypot(x - mx, y - my)
        if (index == start or z <= height) and off > limits.distance_m:
            return _Touchdown(off, max(first.time_s, float(track.time_s[index])))
    return None


def _margins(flight: Flight, limits: Limits) -> tuple[Margin, ...]:
    reason = why_undecided(flight)
    landed = flight.outcome == "landed"
    off = off_marker_m(flight, limits)
    time_decided = landed or flight.outcome == "not_landed"
    left_s = limits.time_s - flight.elapsed_s
    distances_m = [gap.distance_m for gap in flight.separations if gap.body_class != "ground"]
    hit = flight.outcome == "collision"
    nearest = 0.0 if hit else min(distances_m, default=math.hypot(*flight.marker_position_m) + 1e3)
    return (
        Margin(
            property="distance",
            value=limits.distance_m - (flight.final_distance_m if off is None else off),
            unit="m",
            decided=off is not None,
            reason=reason if off is None else "",
        ),
        Margin(
            property="time",
            value=left_s if landed else min(0.0, left_s),
            unit="s",
            decided=time_decided,
            reason="" if time_decided else reason,
        ),
        Margin(property="collision", value=nearest, unit="m"),
        Margin(property="crash", value=0.0 if flight.outcome == "crashed" else 1.0, unit="1"),
    )


@dataclass(frozen=True, slots=True)
class _Mechanism:
    """How a flight ended: the violated property, its type and signature, and one sentence."""

    primary: PropertyName | None
    violation_type: ViolationType | None
    signature: str
    sentence: str


def _mechanism(flight: Flight, limits: Limits) -> _Mechanism:
    """Return the first violation of the flight, or how it ended without one."""
    if flight.outcome == "crashed" and flight.crash:
        return _crash(flight.crash)
    if flight.outcome == "collision":
        return _collision(flight, flight.contacts[-1])
    if flight.outcome == "gave_up":
        return _abort(flight, limits)
    if flight.outcome == "not_landed":
        return _not_landed(flight)
    if flight.final_distance_m > limits.distance_m:
        beginning = f"Landed {flight.final_distance_m:.1f} m off the marker"
        return _missed(flight, flight.elapsed_s, beginning)
    if flight.elapsed_s > limits.time_s:
        phase = landing_phase(flight, limits.time_s)
        sentence = f"Landed late, after {flight.elapsed_s:.1f} s."
        return _Mechanism("time", "late", f"late:{phase}", sentence)
    return _Mechanism(None, None, "", f"Landed after {flight.elapsed_s:.1f} s.")


_VERBS = {"raised": "raised", "nonsense": "returned nonsense", "died": "died", "hung": "hung"}


def _crash(crash: Crash) -> _Mechanism:
    message = cut(crash.message, MESSAGE_CHARS)
    text = f"The landing system {_VERBS[crash.kind]}: {crash.error}: {message}".rstrip(": ")
    return _Mechanism("crash", "V", f"V:{crash.error}@{crash.where}", f"{text}.")


def _collision(flight: Flight, contact: Contact) -> _Mechanism:
    speed = f"at {contact.speed_mps:.1f} m/s"
    if contact.body_class == "ground":
        how = "tilted" if contact.tilt_rad > TILTED_RAD else "fast"
        return _Mechanism("collision", "hard", f"hard:{how}", f"Touched down too {how}, {speed}.")
    signature = _collision_signature(flight, contact)
    if contact.body_class == "static":
        return _Mechanism("collision", "III", signature, f"Hit {contact.body} {speed}.")
    view = (
        "The camera had it in view within the last 2 s."
        if was_in_view(flight, contact.body, contact.time_s)
        else "The camera had not had it in view for 2 s."
    )
    return _Mechanism("collision", "IV", signature, f"Collided with {contact.body} {speed}. {view}")


def _collision_signature(flight: Flight, body: Contact | Separation) -> str:
    phase = landing_phase(flight, body.time_s)
    if body.body_class == "static":
        return f"III:{body.kind}:{phase}"
    sight = "seen" if was_in_view(flight, body.body, body.time_s) else "unseen"
    return f"IV:{body.kind}:{phase}:{sight}"


def _abort(flight: Flight, limits: Limits) -> _Mechanism:
    touchdown = _touchdown_off_marker(flight, limits)
    if touchdown:
        beginning = (
            f"Touched the ground {touchdown.distance_m:.1f} m off the marker before it gave up"
        )
        return _missed(flight, touchdown.time_s, beginning)
    if limits.abort == "violation":
        phase = landing_phase(flight, _abort_time(flight))
        return _Mechanism("abort", "abort", f"abort:{phase}", "The landing was aborted.")
    return _Mechanism(None, None, "", "The landing was aborted and the UAV climbed clear.")


def _not_landed(flight: Flight) -> _Mechanism:
    """Distinguish a marker that was never seen or was lost (II) from one seen to the end (late)."""
    phase = landing_phase(flight, flight.elapsed_s)
    # Without diagnostics it is unknown whether the system detected the marker in the picture.
    seen = "detected" if reports_detections(flight) or reports_targets(flight) else "in view"
    last = last_sighting_s(flight)
    if last is None:
        text = f"Not landed; the marker was never {seen}."
        return _Mechanism("time", "II", f"II:never-seen:{phase}", text)
    if flight.elapsed_s - last > LOST_AFTER_S:
        text = f"Not landed; the marker was last {seen} at {last:.1f} s."
        return _Mechanism("time", "II", f"II:lost:{phase}", text)
    text = f"Not landed although the marker was {seen} to the end."
    return _Mechanism("time", "late", f"late:not-landed:{phase}", text)


def _missed(flight: Flight, time_s: float, beginning: str) -> _Mechanism:
    """Return the violation of a touchdown off the marker: what the system mistook for the marker.

    ``time_s`` is the time of the touchdown.  ``beginning`` is the beginning of the sentence, with
    the distance from the marker.
    """
    target = _last_target(flight, time_s)
    if target is not None and math.dist(target, flight.marker_position_m) <= SAME_PLACE_M:
        sentence = f"{beginning}, though its target was right."
        return _Mechanism("distance", "off", "off:knew-better", sentence)
    place = target or _position(flight, time_s)
    decoys = [(math.dist(place, (x, y)), name) for name, x, y in flight.decoys]
    distance_m, name = min(decoys, default=(math.inf, ""))
    if distance_m <= SAME_PLACE_M:
        signature = f"I:{name}:{_phase_of_first_target(flight, place, time_s)}"
        return _Mechanism("distance", "I", signature, f"{beginning}, on {name}.")
    if target is None:
        return _Mechanism("distance", "I", "I?:unknown", f"{beginning}; it does not say on what.")
    signature = f"I:phantom:{_phase_of_first_target(flight, place, time_s)}"
    sentence = f"{beginning}, on something that it took for the marker."
    return _Mechanism("distance", "I", signature, sentence)


def _last_target(flight: Flight, time_s: float) -> tuple[float, float] | None:
    """Return the last target (x, y) that the system reported up to a time."""
    for step in reversed(flight.steps):
        target = step.diagnostics.target_m if step.diagnostics else None
        if step.time_s <= time_s and target:
            return target[0], target[1]
    return None


def _position(flight: Flight, time_s: float) -> tuple[float, float]:
    """Return the position (x, y) of the UAV at a time."""
    index = int(np.searchsorted(flight.uav.time_s, time_s, side="right")) - 1
    x, y = (float(value) for value in flight.uav.position_m[max(0, index), :2])
    return x, y


def _phase_of_first_target(flight: Flight, place: tuple[float, float], end_s: float) -> str:
    """Return the phase in which the system first reported a place as its target."""
    for step in flight.steps:
        target = step.diagnostics.target_m if step.diagnostics else None
        if target is not None and math.dist(target[:2], place) <= SAME_PLACE_M:
            return landing_phase(flight, step.time_s)
    return landing_phase(flight, end_s)


def _abort_time(flight: Flight) -> float:
    return next((e.time_s for e in flight.events if e.name == "abort_command"), flight.elapsed_s)


def _where(flight: Flight) -> str:
    """Return sentences about the UAV's position at the end, and about a hidden marker."""
    x, y, z = (float(value) for value in flight.uav.position_m[-1])
    mx, my = flight.marker_position_m
    distance = math.hypot(x - mx, y - my)
    point = compass_point(x - mx, y - my)
    place = (
        f"{distance:.1f} m {point} of the marker" if distance > OVER_MARKER_M else "over the marker"
    )
    recent = [s for s in flight.steps if s.time_s > flight.elapsed_s - RECENT_S]
    hidden = ""
    share = 1 - sum(s.marker_visible for s in recent) / len(recent) if recent else 0.0
    if share >= LEAST_HIDDEN_SHARE and flight.outcome != "landed":
        hidden = (
            f" In the last 2 s {100 * share:.0f} % of the marker was hidden or out of the frame."
        )
    return f"At {flight.elapsed_s:.1f} s the UAV was {up_m(z):.1f} m up, {place}.{hidden}"
