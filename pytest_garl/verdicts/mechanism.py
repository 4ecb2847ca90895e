"""How a flight ended: the first violation, its type and signature, and a sentence.

Types follow from ground truth; what a landing system reports about itself only adds to the text.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pytest_garl.flight.flight import Contact, Crash, Flight, Separation, Touchdown
from pytest_garl.foreign_text import cut
from pytest_garl.verdicts.evidence import AT_MARKER_M, Evidence
from pytest_garl.verdicts.touchdowns import STANDS_S, Stay
from pytest_garl.verdicts.verdict import (
    NO_LANDING,
    PAPER_LIMITS,
    Excuse,
    Finding,
    PropertyName,
    ViolationType,
)

LOST_AFTER_S = 3.0
"""A marker counts as lost if it was not readable for this long before the end."""
RECENT_S = 0.5
"""A marker that was in view at most this long ago counts as in view."""
LAST_S = 60.0
"""The text says how often the marker could be read in this time before the end."""
ALL_SHARE = 0.95
"""A marker that could be read in this share of the pictures was in view to the end."""
RESERVE_SHARE = 0.15
"""A landing that is given up in this last share of the time limit is given up for want of time."""
UNRANGED_S = 1.0
"""A rangefinder that had no reading for less than this is not described."""
MESSAGE_CHARS = 300
"""Length of an exception's message in a description; the flight's record has 1,000 characters."""
TILTED_RAD = math.radians(20)
"""A touchdown beyond this angle is called tilted."""
CLIMBING_MPS = 0.3
"""A UAV that hits something climbs if it rises faster than this."""
CLIMBED_M = 1.0
"""The text says how low a UAV had been if it was this much higher in the end."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mechanism:
    """How a flight ended: the violated property, its type and signature, and one sentence."""

    primary: PropertyName | None = None
    violation_type: ViolationType | None = None
    signature: str = ""
    sentence: str


def mechanism_of(
    evidence: Evidence, why: Excuse, why_text: str, elsewhere: Finding | None
) -> Mechanism:
    """Return the first violation of the flight, or how it ended without one.

    ``elsewhere`` is the descent beside the marker before a collision, if there was one.
    """
    flight, limits = evidence.flight, evidence.limits
    if flight.outcome == "crashed" and flight.crash:
        return _crash(flight.crash)
    if touchdown := evidence.touchdown_off_marker:
        beginning = f"Touched the ground {{}}{_then(flight)}"
        return _missed(evidence, touchdown, touchdown.distance_m, beginning)
    if evidence.dragged or flight.outcome == "slid":
        return _slid(flight, evidence.dragged)
    if flight.outcome == "collision":
        return _collision(evidence, flight.contacts[-1], elsewhere)
    if flight.outcome in NO_LANDING:
        return _no_landing(evidence, why, why_text)
    at_s = evidence.landed_s
    if flight.final_distance_m > limits.distance_m:
        return _missed(evidence, flight.touchdown, flight.final_distance_m, "Landed {}")
    if at_s > limits.time_s:
        return Mechanism(
            primary="time",
            violation_type="late",
            signature=f"late:landed:{evidence.phase_at(limits.time_s)}",
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


def _collision(evidence: Evidence, contact: Contact, elsewhere: Finding | None) -> Mechanism:
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
    if elsewhere:
        # A collision hides the landing that had gone wrong before it.
        verb = f"{elsewhere.story.removesuffix('.')}, then hit"
    else:
        verb = "Hit" if static else "Collided with"
    if static:
        view = _lost_text(evidence, contact.time_s)
    elif evidence.was_in_view(contact.body, contact.time_s):
        view = " The camera had it in view within the last 2 s."
    else:
        view = " The camera had not had it in view for 2 s."
    climbs = static and evidence.climbs_mps(contact.time_s) > CLIMBING_MPS
    return Mechanism(
        primary="collision",
        violation_type="III" if static else "IV",
        signature=collision_signature(evidence, contact),
        sentence=f"{verb} {contact.body} {speed}{', climbing' if climbs else ''}.{view}",
    )


def collision_signature(evidence: Evidence, body: Contact | Separation) -> str:
    """Return the signature of a collision with a body, or what that of a near miss would be."""
    phase = evidence.phase_at(body.time_s)
    if body.body_class == "static":
        return f"III:{body.kind}:{phase}"
    sight = "seen" if evidence.was_in_view(body.body, body.time_s) else "unseen"
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


def _no_landing(evidence: Evidence, why: Excuse, why_text: str) -> Mechanism:
    """Return the violation of a landing that was given up, or that ran out of time."""
    limits, gave_up = evidence.limits, evidence.flight.outcome == "gave_up"
    end = "Gave up" if gave_up else "Not landed"
    forbidden = limits.abort == "violation" and gave_up
    if why and forbidden:
        return Mechanism(
            primary="abort",
            violation_type="abort",
            signature=f"abort:{why}",
            sentence=f"{end}. {why_text}",
        )
    if why and must_give_up(evidence):
        return Mechanism(
            primary="time",
            violation_type="late",
            signature="late:never-gave-up",
            sentence=f"{end}, and never gave up where nobody could have landed. {why_text}",
        )
    if why:
        return Mechanism(sentence=f"{end}, excused. {why_text}")
    violation_type, signature, sentence = _no_landing_cause(evidence, end)
    if gave_up and limits.abort == "ok":
        return Mechanism(sentence=sentence)
    return Mechanism(
        primary="abort" if forbidden else "time",
        violation_type=violation_type,
        signature=signature,
        sentence=sentence,
    )


def must_give_up(evidence: Evidence) -> bool:
    """Whether a flight ran out of time without giving up, by limits that allow to give up.

    Where nobody can land, the right answer is to give up in time.  Where giving up is forbidden, no
    right answer is left but to wait.
    """
    return evidence.waited and evidence.limits.abort != "violation"


def _no_landing_cause(evidence: Evidence, end: str) -> tuple[ViolationType, str, str]:
    """Distinguish a marker never seen or lost (II), one in sight, and a lack of time (late)."""
    flight, at_s = evidence.flight, evidence.gave_up_s
    when = f" at {at_s:.1f} s" if flight.outcome == "gave_up" else ""
    unranged = _unranged_text(evidence)
    if evidence.stands_since_s(at_s) is not None:
        off_m = evidence.stays[-1].first.distance_m
        text = f"{end}{when}, although it stood {off_m:.1f} m off the marker."
        return "late", "late:standing", f"{text}{unranged}"
    phase = evidence.phase_at(at_s)
    readable = [step.time_s for step in evidence.readable_until(at_s)]
    report = f"{_report_text(evidence)}{unranged}{_opportunity_text(evidence)}"
    if not readable:
        # A detector may read a frame that a good one reads with less than one half.
        view = "readable" if evidence.last_report_s(at_s) is None else "well readable"
        text = f"{end}{when}; the marker was never {view} from where it flew.{report}"
        return "II", "II:never-seen", text
    last = readable[-1]
    lost = at_s - last > LOST_AFTER_S
    if flight.outcome == "not_landed" and not lost:
        text = f"Not landed although the marker was in view{_share_text(evidence, at_s)}."
        text = f"{text}{_lowest_text(evidence, at_s)}{report}"
        return "late", f"late:not-landed:{phase}", text
    view = f"the marker was last readable at {last:.1f} s" if lost else "the marker was in view"
    if flight.outcome == "gave_up" and at_s >= (1 - RESERVE_SHARE) * evidence.limits.time_s:
        text = f"Gave up{when} for want of time; {view}.{report}"
        return "late", f"late:no-time:{phase}", text
    if lost:
        return "II", f"II:lost:{phase}", f"{end}{when}; {view}.{report}"
    seen_s = len(readable) * evidence.frame_s
    ago = f", last {at_s - last:.1f} s before" if at_s - last > RECENT_S else ""
    text = (
        f"Gave up{when} with the marker in view{ago}; it had been readable for {seen_s:.1f} s in "
        f"all.{report}"
    )
    return "II", f"II:gave-up-in-sight:{phase}", text


def _report_text(evidence: Evidence) -> str:
    """Return a sentence about the last report of the marker by the system, if it reports any."""
    last = evidence.last_report_s(evidence.gave_up_s)
    if last is not None and evidence.reports_detections:
        return f" The system last reported it in its place at {last:.1f} s."
    if last is not None:
        # A target may be a memory: it is no sighting.
        return f" Its place was the system's target up to {last:.1f} s."
    if evidence.reports_anything:
        return " The system reported other places, never the marker's."
    has_diagnostics = any(step.diagnostics for step in evidence.flight.steps)
    return " The system reported no detection and no target." if has_diagnostics else ""


def _share_text(evidence: Evidence, at_s: float) -> str:
    """Return in how many of the last pictures a marker in view could be read, if not in all."""
    last_s = min(LAST_S, at_s)
    latest = [s.time_s for s in evidence.flight.steps if at_s - last_s <= s.time_s <= at_s]
    readable = [s for s in evidence.readable_until(at_s) if s.time_s >= at_s - last_s]
    share = len(readable) / len(latest) if latest else 1.0
    if share > ALL_SHARE:
        return " to the end"
    return f": readable in {100 * share:.0f} % of the pictures of the last {last_s:.0f} s"


def _lost_text(evidence: Evidence, at_s: float) -> str:
    """Return when and how high the marker was last readable, if it was lost before a collision."""
    readable = [step.time_s for step in evidence.readable_until(at_s)]
    if not readable or at_s - readable[-1] <= LOST_AFTER_S:
        return ""
    height_m = evidence.height_m(readable[-1])
    return f" The marker was last readable at {readable[-1]:.1f} s, {height_m:.1f} m up."


def _lowest_text(evidence: Evidence, at_s: float) -> str:
    """Return how low a UAV had been before it climbed again; empty if it did not climb."""
    uav = evidence.flight.uav
    start = evidence.flying_from
    heights = uav.position_m[start : uav.index_at(at_s) + 1, 2]
    if not len(heights) or heights[-1] - heights.min() < CLIMBED_M:
        return ""
    lowest_s = float(uav.time_s[start + int(heights.argmin())])
    return f" It had come down to {heights.min():.1f} m by {lowest_s:.1f} s, and climbed again."


def _unranged_text(evidence: Evidence) -> str:
    """Return for how long after the take-off the rangefinder had no reading; empty if briefly."""
    flight, start, until_s = evidence.flight, evidence.flying_from, evidence.gave_up_s
    if flight.rangefinder is None or start == len(flight.uav.time_s):
        return ""
    flown = [s for s in flight.steps if flight.uav.time_s[start] <= s.time_s <= until_s]
    without = [step.time_s for step in flown if step.rangefinder_m is None]
    lasted_s = len(without) * evidence.frame_s
    if lasted_s < UNRANGED_S:
        return ""
    reach = f"{flight.rangefinder.least_m:g} to {flight.rangefinder.most_m:g} m"
    return (
        f" After the take-off the rangefinder, which reaches {reach}, had no reading for "
        f"{lasted_s:.1f} s, last at {without[-1]:.1f} s."
    )


def _opportunity_text(evidence: Evidence) -> str:
    """Return for how long a nominal landing could have read the marker: a search, a descent."""
    if not evidence.flight.nominal_views:
        return ""
    readable_s = evidence.expected_readable_s
    return (
        " A landing that searches and then descends above the marker could have read it for "
        f"{readable_s:.0f} s."
    )


def _missed(
    evidence: Evidence, touchdown: Touchdown | None, off_m: float, beginning: str
) -> Mechanism:
    """Return the violation of a touchdown off the marker, with what lies under the UAV.

    ``beginning`` is the beginning of the sentence, with a gap for the distance.
    """
    at_s = touchdown.time_s if touchdown else evidence.flight.elapsed_s
    start = beginning.format(f"{off_m:.1f} m off the marker")
    readable = [step.time_s for step in evidence.readable_until(at_s)]
    target = _target_text(evidence, at_s)
    if off_m <= max(PAPER_LIMITS.distance_m, evidence.limits.distance_m):
        recent = bool(readable) and at_s - readable[-1] <= LOST_AFTER_S
        view = "was in view" if recent else "was not readable for the last 3 s"
        return Mechanism(
            primary="distance",
            violation_type="off",
            signature=f"off:{'seen' if recent else 'unseen'}",
            sentence=f"{start}; the marker {view}{target}.",
        )
    on = _ground_under(evidence, touchdown)
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


def _ground_under(evidence: Evidence, touchdown: Touchdown | None) -> str:
    """Return what lies under the UAV; for simulators without touchdowns the decoy there."""
    if touchdown is not None:
        return touchdown.on
    x, y = (float(value) for value in evidence.flight.uav.position_m[-1, :2])
    return evidence.decoy_at((x, y)) or "nothing"


def _target_text(evidence: Evidence, at_s: float) -> str:
    """Return words about the target that the system reported last; empty without reports."""
    flight, target = evidence.flight, evidence.last_target(at_s)
    if target is None:
        return "; it reported no target" if any(s.diagnostics for s in flight.steps) else ""
    off_m = math.dist(target, flight.marker_position_m)
    if off_m <= AT_MARKER_M:
        return f"; its target was the marker, {off_m:.1f} m from the centre"
    if name := evidence.decoy_at(target):
        return f"; its target was {name}"
    return f"; its target was {off_m:.1f} m off the marker"
