"""Judge a flight: a pure function of the flight and the limits that returns a verdict."""

from __future__ import annotations

import math

import numpy as np

from pytest_garl.simulation.flight import Contact, Flight, Separation
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
its height at the contact: the feet spring a little."""
LOST_AFTER_S = 3.0
"""A marker not seen for this long before the end is lost."""
MESSAGE_CHARS = 300
"""Length of an exception's message in a description; the flight's record has 1,000 characters."""
SAME_PLACE_M = 1.5
"""A target and a decoy, or a target and the marker, within this distance are the same place: the
length of the marker's side."""
CLOSE_CALL_M = 3.0
"""A body farther away than this is no close call; exact separations end here too."""
TILTED_RAD = math.radians(20)
"""A touchdown beyond this angle is called tilted."""
RECENT_S = 2.0
"""Length of the last part of a flight in which a hidden marker is described."""


def judge(flight: Flight, limits: Limits) -> Verdict:
    """Return the verdict: the first violation of the flight, or none.

    A touchdown off the marker before an abort is a violation.  It is no violation by the paper's
    definition, which measures the distance of landings alone.
    """
    primary, violation_type, signature, what = _mechanism(flight, limits)
    far = flight.final_distance_m > PAPER_LIMITS.distance_m
    paper = (
        flight.outcome == "collision"
        or flight.outcome == "not_landed"
        or (flight.outcome == "landed" and far)
    )
    return Verdict(
        outcome=flight.outcome,
        primary=primary,
        violation_type=violation_type,
        signature=signature,
        paper_violation=paper,
        margins=_margins(flight, limits),
        story=f"{what} {_where(flight)}".strip(),
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
    if flight.outcome == "aborted":
        return f"aborted {when}"
    if flight.outcome == "crashed":
        return f"the landing system crashed {when}"
    return f"not landed after {flight.elapsed_s:.0f} s"


def off_marker_m(flight: Flight, limits: Limits) -> float | None:
    """Return the distance from the marker at which the UAV came down; None if it did not.

    An aborted flight came down if it touched the ground beyond the limit: it took a wrong place
    for the marker, whatever it did next.
    """
    if flight.outcome == "landed":
        return flight.final_distance_m
    touch = _touch_off_marker(flight, limits)
    return touch[0] if touch else None


def _touch_off_marker(flight: Flight, limits: Limits) -> tuple[float, float] | None:
    """Return distance and time of an aborted flight's first touchdown beyond the limit, or None.

    The record holds only the first contact with the ground; later ones follow from the height.
    """
    first = next((each for each in flight.contacts if each.body_class == "ground"), None)
    if flight.outcome != "aborted" or first is None:
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
            return off, max(first.time_s, float(track.time_s[index]))
    return None


def _margins(flight: Flight, limits: Limits) -> tuple[Margin, ...]:
    reason = why_undecided(flight)
    landed = flight.outcome == "landed"
    off = off_marker_m(flight, limits)
    timed = landed or flight.outcome == "not_landed"
    solid = [gap.distance_m for gap in flight.separations if gap.body_class != "ground"]
    hit = flight.outcome == "collision"
    nearest = 0.0 if hit else min(solid, default=math.hypot(*flight.marker_position_m) + 1e3)
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
            value=limits.time_s - flight.elapsed_s
            if landed
            else min(0.0, limits.time_s - flight.elapsed_s),
            unit="s",
            decided=timed,
            reason="" if timed else reason,
        ),
        Margin(property="collision", value=nearest, unit="m"),
        Margin(property="crash", value=0.0 if flight.outcome == "crashed" else 1.0, unit="1"),
    )


def _mechanism(
    flight: Flight, limits: Limits
) -> tuple[PropertyName | None, ViolationType | None, str, str]:
    if flight.outcome == "crashed" and flight.crash:
        crash = flight.crash
        message = cut(crash.message, MESSAGE_CHARS)
        text = f"The landing system {_VERBS[crash.kind]}: {crash.error}: {message}".rstrip(": ")
        return "crash", "V", f"V:{crash.error}@{crash.where}", text + "."
    if flight.outcome == "collision":
        return _collision(flight, flight.contacts[-1])
    if flight.outcome == "aborted":
        touch = _touch_off_marker(flight, limits)
        if touch:
            off = f"Touched the ground {touch[0]:.1f} m off the marker before it gave up"
            return _missed(flight, touch[1], off)
        phase = landing_phase(flight, _abort_time(flight))
        if limits.abort == "violation":
            return "abort", "abort", f"abort:{phase}", "The landing was aborted."
        return None, None, "", "The landing was aborted and the UAV climbed clear."
    if flight.outcome == "not_landed":
        return _not_landed(flight)
    if flight.final_distance_m > limits.distance_m:
        off = f"Landed {flight.final_distance_m:.1f} m off the marker"
        return _missed(flight, flight.elapsed_s, off)
    if flight.elapsed_s > limits.time_s:
        phase = landing_phase(flight, limits.time_s)
        return "time", "late", f"late:{phase}", f"Landed late, after {flight.elapsed_s:.1f} s."
    return None, None, "", f"Landed after {flight.elapsed_s:.1f} s."


_VERBS = {"raised": "raised", "nonsense": "returned nonsense", "died": "died", "hung": "hung"}


def _collision(flight: Flight, contact: Contact) -> tuple[PropertyName, ViolationType, str, str]:
    speed = f"at {contact.speed_mps:.1f} m/s"
    if contact.body_class == "ground":
        tilted = contact.tilt_rad > TILTED_RAD
        how = "tilted" if tilted else "fast"
        return "collision", "hard", f"hard:{how}", f"Touched down too {how}, {speed}."
    signature = _collision_signature(flight, contact)
    if contact.body_class == "static":
        return "collision", "III", signature, f"Hit {contact.body} {speed}."
    seen = was_in_view(flight, contact.body, contact.time_s)
    view = (
        "The camera had it in view within the last 2 s."
        if seen
        else "The camera had not had it in view for 2 s."
    )
    text = f"Collided with {contact.body} {speed}. {view}"
    return "collision", "IV", signature, text


def _collision_signature(flight: Flight, met: Contact | Separation) -> str:
    phase = landing_phase(flight, met.time_s)
    if met.body_class == "static":
        return f"III:{met.kind}:{phase}"
    sight = "seen" if was_in_view(flight, met.body, met.time_s) else "unseen"
    return f"IV:{met.kind}:{phase}:{sight}"


def _not_landed(flight: Flight) -> tuple[PropertyName, ViolationType, str, str]:
    """Distinguish a marker never seen or lost (II) from one seen to the end (late)."""
    phase = landing_phase(flight, flight.elapsed_s)
    # Without diagnostics nobody knows whether the system detected the marker in the picture.
    seen = "detected" if reports_detections(flight) or reports_targets(flight) else "in view"
    last = last_sighting_s(flight)
    if last is None:
        return "time", "II", f"II:never-seen:{phase}", f"Not landed; the marker was never {seen}."
    if flight.elapsed_s - last > LOST_AFTER_S:
        text = f"Not landed; the marker was last {seen} at {last:.1f} s."
        return "time", "II", f"II:lost:{phase}", text
    text = f"Not landed although the marker was {seen} to the end."
    return "time", "late", f"late:not-landed:{phase}", text


def _missed(
    flight: Flight, time_s: float, off: str
) -> tuple[PropertyName, ViolationType, str, str]:
    """Return the violation of a touchdown elsewhere at ``time_s``: what was taken for the marker.

    ``off`` is the beginning of the sentence, with the distance from the marker.
    """
    index = int(np.searchsorted(flight.uav.time_s, time_s, side="right")) - 1
    x, y = (float(value) for value in flight.uav.position_m[max(0, index), :2])
    target = next(
        (
            s.diagnostics.target_m
            for s in reversed(flight.steps)
            if s.time_s <= time_s and s.diagnostics and s.diagnostics.target_m
        ),
        None,
    )
    if target is not None and math.dist(target[:2], flight.marker_position_m) <= SAME_PLACE_M:
        return "distance", "off", "off:knew-better", f"{off}, though its target was right."
    place = target[:2] if target is not None else (x, y)
    near = [
        (math.dist(place, (dx, dy)), name)
        for name, dx, dy in flight.decoys
        if math.dist(place, (dx, dy)) <= SAME_PLACE_M
    ]
    if near:
        name = min(near)[1]
        taken = _taken_at(flight, place, time_s)
        return "distance", "I", f"I:{name}:{taken}", f"{off}, on {name}."
    if target is None:
        return "distance", "I", "I?:unknown", f"{off}; it does not say on what."
    text = f"{off}, on something that it took for the marker."
    return "distance", "I", f"I:phantom:{_taken_at(flight, place, time_s)}", text


def _taken_at(flight: Flight, place: tuple[float, ...], end_s: float) -> str:
    for step in flight.steps:
        target = step.diagnostics.target_m if step.diagnostics else None
        if target is not None and math.dist(target[:2], place) <= SAME_PLACE_M:
            return landing_phase(flight, step.time_s)
    return landing_phase(flight, end_s)


def _abort_time(flight: Flight) -> float:
    return next((e.time_s for e in flight.events if e.name == "abort_command"), flight.elapsed_s)


def _where(flight: Flight) -> str:
    x, y, z = (float(value) for value in flight.uav.position_m[-1])
    mx, my = flight.marker_position_m
    distance = math.hypot(x - mx, y - my)
    point = compass_point(x - mx, y - my)
    place = f"{distance:.1f} m {point} of the marker" if distance > 0.3 else "over the marker"
    recent = [s for s in flight.steps if s.time_s > flight.elapsed_s - RECENT_S]
    hidden = ""
    share = 1 - sum(s.marker_visible for s in recent) / len(recent) if recent else 0.0
    if share >= 0.01 and flight.outcome != "landed":
        hidden = (
            f" In the last 2 s {100 * share:.0f} % of the marker was hidden or out of the frame."
        )
    return f"At {flight.elapsed_s:.1f} s the UAV was {up_m(z):.1f} m up, {place}.{hidden}"
