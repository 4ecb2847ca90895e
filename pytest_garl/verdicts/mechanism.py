"""How a flight ended: the first violation, its type and signature, and a sentence.

Types follow from ground truth; what a landing system reports about itself only adds to the text.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pytest_garl.simulation.flight import Contact, Crash, Flight, Separation, Touchdown
from pytest_garl.simulation.system_under_test.texts import cut
from pytest_garl.verdicts.excuses import expected_readable_s
from pytest_garl.verdicts.findings import descent_elsewhere
from pytest_garl.verdicts.phases import flying_from, landing_phase
from pytest_garl.verdicts.sightings import (
    AT_MARKER_M,
    last_report_s,
    last_target,
    readable_steps,
    reports_detections,
    was_in_view,
)
from pytest_garl.verdicts.touchdowns import (
    STANDS_S,
    Stay,
    dragged,
    gave_up_s,
    landed_s,
    said_abort_s,
    stands_since_s,
    stays,
    touchdown_off_marker,
)
from pytest_garl.verdicts.verdict import (
    PAPER_LIMITS,
    Excuse,
    Limits,
    PropertyName,
    ViolationType,
)

LOST_AFTER_S = 3.0
"""A marker counts as lost if it was not readable for this long before the end."""
RECENT_S = 0.5
"""A marker that was in view so long ago is in view."""
RESERVE_SHARE = 0.15
"""A landing that is given up in this last share of the time limit is given up for want of time."""
UNRANGED_S = 1.0
"""A rangefinder that had no reading for less than this is not described."""
MESSAGE_CHARS = 300
"""Length of an exception's message in a description; the flight's record has 1,000 characters."""
TILTED_RAD = math.radians(20)
"""A touchdown beyond this angle is called tilted."""
NO_LANDING = ("gave_up", "not_landed")
"""Outcomes of flights that never came down."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mechanism:
    """How a flight ended: the violated property, its type and signature, and one sentence."""

    primary: PropertyName | None = None
    violation_type: ViolationType | None = None
    signature: str = ""
    sentence: str


def mechanism_of(flight: Flight, limits: Limits, why: Excuse, why_text: str) -> Mechanism:
    """Return the first violation of the flight, or how it ended without one."""
    if flight.outcome == "crashed" and flight.crash:
        return _crash(flight.crash)
    if touchdown := touchdown_off_marker(flight, limits):
        beginning = f"Touched the ground {{}}{_then(flight)}"
        return _missed(flight, limits, touchdown, touchdown.distance_m, beginning)
    stay = dragged(flight, limits)
    if stay or flight.outcome == "slid":
        return _slid(flight, stay)
    if flight.outcome == "collision":
        return _collision(flight, flight.contacts[-1], limits)
    if flight.outcome in NO_LANDING:
        return _no_landing(flight, limits, why, why_text)
    at_s = landed_s(flight)
    if flight.final_distance_m > limits.distance_m:
        return _missed(flight, limits, flight.touchdown, flight.final_distance_m, "Landed {}")
    if at_s > limits.time_s:
        return Mechanism(
            primary="time",
            violation_type="late",
            signature=f"late:landed:{landing_phase(flight, limits.time_s)}",
            sentence=f"Landed late, after {at_s:.1f} s.",
        )
    return Mechanism(sentence=f"Landed after {at_s:.1f} s.")


_VERBS = {"raised": "raised", "nonsense": "returned nonsense", "died": "died", "hung": "hung"}


def _crash(crash: Crash) -> Mechanism:
    message = cut(crash.message, MESSAGE_CHARS)
    text = f"The landing system {_VERBS[crash.kind]}: {crash.error}: {message}".rstrip(": ")
    return Mechanism(
        primary="crash",
        violation_type="V",
        signature=f"V:{crash.error}@{crash.where}",
        sentence=f"{text}.",
    )


def _collision(flight: Flight, contact: Contact, limits: Limits) -> Mechanism:
    speed = f"at {contact.speed_mps:.1f} m/s"
    if contact.body_class == "ground":
        how = "tilted" if contact.tilt_rad > TILTED_RAD else "fast"
        return Mechanism(
            primary="collision",
            violation_type="hard",
            signature=f"hard:{how}",
            sentence=f"Touched down too {how}, {speed}.",
        )
    static = contact.body_class == "static"
    elsewhere = descent_elsewhere(flight, limits)
    if elsewhere:
        # A collision hides the landing that had gone wrong before it.
        verb = f"{elsewhere.story.removesuffix('.')}, then hit"
    else:
        verb = "Hit" if static else "Collided with"
    view = ""
    if not static and was_in_view(flight, contact.body, contact.time_s):
        view = " The camera had it in view within the last 2 s."
    elif not static:
        view = " The camera had not had it in view for 2 s."
    return Mechanism(
        primary="collision",
        violation_type="III" if static else "IV",
        signature=collision_signature(flight, contact),
        sentence=f"{verb} {contact.body} {speed}.{view}",
    )


def collision_signature(flight: Flight, body: Contact | Separation) -> str:
    """Return the signature of a collision with a body, or what that of a near miss would be."""
    phase = landing_phase(flight, body.time_s)
    if body.body_class == "static":
        return f"III:{body.kind}:{phase}"
    sight = "seen" if was_in_view(flight, body.body, body.time_s) else "unseen"
    return f"IV:{body.kind}:{phase}:{sight}"


def _slid(flight: Flight, stay: Stay | None) -> Mechanism:
    if stay is None:
        text, motors = "Slid over the ground after its touchdown.", "motors-on"
    else:
        slid_s = next((e.time_s for e in flight.events if e.name == "slid"), flight.elapsed_s)
        stopped = stay.stopped_s is not None and stay.stopped_s <= slid_s
        motors = "motors-off" if stopped else "motors-on"
        still = f"with the motors {'stopped' if stopped else 'running'}"
        stood = ""
        if stay.left_s is not None and stay.left_s - stay.since_s >= STANDS_S:
            stood = f"stood there with running motors until {stay.left_s:.1f} s, "
        text = (
            f"Touched down {stay.first.distance_m:.1f} m off the marker at {stay.since_s:.1f} s, "
            f"{stood}then slid {stay.moved_m:.1f} m over the ground{hops_text(stay)} "
            f"{still}{'' if flight.outcome == 'slid' else _then(flight)}."
        )
    return Mechanism(
        primary="distance", violation_type="slid", signature=f"slid:{motors}", sentence=text
    )


def hops_text(stay: Stay) -> str:
    """Return how high a UAV hopped in its stay on the ground; empty if it did not."""
    if len(stay.touchdowns) < 2:
        return ""
    return f", with hops of up to {max(1.0, 100 * stay.hop_m):.0f} cm,"


def _no_landing(flight: Flight, limits: Limits, why: Excuse, why_text: str) -> Mechanism:
    """Return the violation of a landing that was given up, or that ran out of time."""
    gave_up = flight.outcome == "gave_up"
    end = "Gave up" if gave_up else "Not landed"
    forbidden = limits.abort == "violation" and gave_up
    if why and forbidden:
        return Mechanism(
            primary="abort",
            violation_type="abort",
            signature=f"abort:{why}",
            sentence=f"{end}. {why_text}",
        )
    if why and must_give_up(flight, limits):
        return Mechanism(
            primary="time",
            violation_type="late",
            signature="late:never-gave-up",
            sentence=f"{end}, and never gave up where nobody could have landed. {why_text}",
        )
    if why:
        return Mechanism(sentence=f"{end}, excused. {why_text}")
    violation_type, signature, sentence = _no_landing_cause(flight, limits, end)
    if gave_up and limits.abort == "ok":
        return Mechanism(sentence=sentence)
    return Mechanism(
        primary="abort" if forbidden else "time",
        violation_type=violation_type,
        signature=signature,
        sentence=sentence,
    )


def must_give_up(flight: Flight, limits: Limits) -> bool:
    """Whether a flight ran out of time without giving up, by limits that allow to give up.

    Where nobody can land, the right answer is to give up in time.  Where giving up is forbidden, no
    right answer is left but to wait.
    """
    waited = flight.outcome == "not_landed" and said_abort_s(flight) is None
    return waited and limits.abort != "violation"


def _no_landing_cause(flight: Flight, limits: Limits, end: str) -> tuple[ViolationType, str, str]:
    """Distinguish a marker never seen or lost (II), one in sight, and a lack of time (late)."""
    at_s = gave_up_s(flight)
    if stands_since_s(flight, at_s) is not None:
        off_m = stays(flight)[-1].first.distance_m
        when = f" at {at_s:.1f} s" if flight.outcome == "gave_up" else ""
        text = f"{end}{when}, although it stood {off_m:.1f} m off the marker."
        return "late", "late:standing", f"{text}{_unranged_text(flight, at_s)}"
    phase = landing_phase(flight, at_s)
    readable = [step.time_s for step in readable_steps(flight, at_s)]
    report = (
        f"{_report_text(flight, at_s)}{_unranged_text(flight, at_s)}{_opportunity_text(flight)}"
    )
    when = f" at {at_s:.1f} s" if flight.outcome == "gave_up" else ""
    if not readable:
        # A detector may read a frame that a good one reads with less than one half.
        view = "readable" if last_report_s(flight, at_s) is None else "well readable"
        return "II", "II:never-seen", f"{end}{when}; the marker was never {view}.{report}"
    last = readable[-1]
    lost = at_s - last > LOST_AFTER_S
    if flight.outcome == "not_landed" and not lost:
        text = f"Not landed although the marker was in view to the end.{report}"
        return "late", f"late:not-landed:{phase}", text
    view = f"the marker was last readable at {last:.1f} s" if lost else "the marker was in view"
    if flight.outcome == "gave_up" and at_s >= (1 - RESERVE_SHARE) * limits.time_s:
        text = f"Gave up{when} for want of time; {view}.{report}"
        return "late", f"late:no-time:{phase}", text
    if lost:
        return "II", f"II:lost:{phase}", f"{end}{when}; {view}.{report}"
    seen_s = len(readable) * _frame_s(flight)
    ago = f", last {at_s - last:.1f} s before" if at_s - last > RECENT_S else ""
    text = (
        f"Gave up{when} with the marker in view{ago}; it had been readable for {seen_s:.1f} s."
        f"{report}"
    )
    return "II", f"II:gave-up-in-sight:{phase}", text


def _report_text(flight: Flight, until_s: float) -> str:
    """Return a sentence about the last report of the marker by the system, if it reports any."""
    last = last_report_s(flight, until_s)
    if last is not None and reports_detections(flight):
        return f" The system last reported it at {last:.1f} s."
    if last is not None:
        # A target may be a memory: it is no sighting.
        return f" Its place was the system's target up to {last:.1f} s."
    reports = any(
        step.diagnostics and (step.diagnostics.detections or step.diagnostics.target_m)
        for step in flight.steps
    )
    return " The system reported other places, never the marker's." if reports else ""


def _unranged_text(flight: Flight, until_s: float) -> str:
    """Return for how long after the take-off the rangefinder had no reading; empty if briefly."""
    start = flying_from(flight)
    if flight.rangefinder is None or start == len(flight.uav.time_s):
        return ""
    flown = [s for s in flight.steps if flight.uav.time_s[start] <= s.time_s <= until_s]
    without = [step.time_s for step in flown if step.rangefinder_m is None]
    lasted_s = len(without) * _frame_s(flight)
    if lasted_s < UNRANGED_S:
        return ""
    reach = f"{flight.rangefinder.least_m:g} to {flight.rangefinder.most_m:g} m"
    return (
        f" After the take-off the rangefinder, which reaches {reach}, had no reading for "
        f"{lasted_s:.1f} s, last at {without[-1]:.1f} s."
    )


def _opportunity_text(flight: Flight) -> str:
    """Return for how long a nominal landing could have read the marker."""
    if not flight.nominal_views:
        return ""
    readable_s = expected_readable_s(flight)
    return f" Where a landing looks for it, it could be read for {readable_s:.0f} s."


def _missed(
    flight: Flight, limits: Limits, touchdown: Touchdown | None, off_m: float, beginning: str
) -> Mechanism:
    """Return the violation of a touchdown off the marker, with what lies under the UAV.

    ``beginning`` is the beginning of the sentence, with a gap for the distance.
    """
    at_s = touchdown.time_s if touchdown else flight.elapsed_s
    start = beginning.format(f"{off_m:.1f} m off the marker")
    readable = [step.time_s for step in readable_steps(flight, at_s)]
    target = _target_text(flight, at_s)
    if off_m <= max(PAPER_LIMITS.distance_m, limits.distance_m):
        recent = bool(readable) and at_s - readable[-1] <= LOST_AFTER_S
        view = "was in view" if recent else "was not readable for the last 3 s"
        return Mechanism(
            primary="distance",
            violation_type="off",
            signature=f"off:{'seen' if recent else 'unseen'}",
            sentence=f"{start}; the marker {view}{target}.",
        )
    on = _ground_under(flight, touchdown)
    seen = "seen" if readable else "unseen"
    view = "had been in view" if readable else "was never readable"
    what = "on open ground" if on == "nothing" else f"on a {on}" if on in _PLAIN else f"on {on}"
    return Mechanism(
        primary="distance",
        violation_type="I",
        signature=f"I:{on}:{seen}",
        sentence=f"{start}, {what}; the marker {view}{target}.",
    )


def _then(flight: Flight) -> str:
    """Return words about what followed a touchdown off the marker."""
    match flight.outcome:
        case "gave_up":
            return " before it gave up"
        case "collision":
            return f" before it met {flight.contacts[-1].body}"
        case "landed":
            return " before it landed on the marker"
        case "slid":
            return " and slid on"
    return ""


_PLAIN = ("line", "shadow")


def _ground_under(flight: Flight, touchdown: Touchdown | None) -> str:
    """Return what lies under the UAV; for simulators without touchdowns the decoy there."""
    if touchdown is not None:
        return touchdown.on
    x, y = (float(value) for value in flight.uav.position_m[-1, :2])
    near = [(math.dist((x, y), place), name) for name, *place in flight.decoys]
    distance_m, name = min(near, default=(math.inf, ""))
    return name if distance_m <= AT_MARKER_M else "nothing"


def _target_text(flight: Flight, at_s: float) -> str:
    """Return words about the target that the system reported last; empty without reports."""
    target = last_target(flight, at_s)
    if target is None:
        return "; it reported no target" if any(s.diagnostics for s in flight.steps) else ""
    if math.dist(target, flight.marker_position_m) <= AT_MARKER_M:
        return "; its target was right"
    near = [(math.dist(target, place), name) for name, *place in flight.decoys]
    distance_m, name = min(near, default=(math.inf, ""))
    if distance_m <= AT_MARKER_M:
        return f"; its target was {name}"
    off_m = math.dist(target, flight.marker_position_m)
    return f"; its target was {off_m:.1f} m off the marker"


def _frame_s(flight: Flight) -> float:
    times = [step.time_s for step in flight.steps[:2]]
    return times[1] - times[0] if len(times) == 2 else 0.0
