"""Judge a flight: a pure function of the flight and the limits that returns a verdict.

The first event decides the outcome.  Types follow from ground truth; what a landing system reports
about itself only adds to the text.
"""

from __future__ import annotations

import math

import numpy as np

from pytest_garl.flight.flight import Flight
from pytest_garl.flight.thresholds import feet_height_m
from pytest_garl.verdicts.ending import with_cause
from pytest_garl.verdicts.evidence import Evidence
from pytest_garl.verdicts.excuses import excuse
from pytest_garl.verdicts.findings import descent_elsewhere, findings
from pytest_garl.verdicts.held import NO_TARGET, Held
from pytest_garl.verdicts.margins import margins
from pytest_garl.verdicts.mechanism import (
    collision_signature,
    hops_text,
    mechanism_of,
    must_give_up,
)
from pytest_garl.verdicts.verdict import PAPER_LIMITS, Limits, Verdict
from pytest_garl.verdicts.wording import compass_point

CLOSE_CALL_M = 3.0
"""A close call is within this distance; exact separations end here too."""
RECENT_S = 2.0
"""Length of the last part of a flight in which a hidden marker is described."""
LEAST_HIDDEN_SHARE = 0.01
"""A smaller hidden share of the marker is not described."""
OVER_MARKER_M = 0.3
"""A UAV within this horizontal distance is described as over the marker."""


def judge(flight: Flight, limits: Limits) -> Verdict:
    """Return the verdict on a flight: its first violation, or none."""
    return verdict_on(Evidence(flight, limits))


def verdict_on(evidence: Evidence) -> Verdict:
    """Return the verdict that the evidence of a flight leads to.

    A touchdown off the marker before the landing is given up is a violation, but not by the paper's
    definition, which measures the distance of landings only.
    """
    if evidence.holds and evidence.flight.outcome != "crashed":
        return _verdict_on_held(evidence)
    flight = evidence.flight
    why, why_text = excuse(evidence)
    elsewhere = descent_elsewhere(evidence)
    mechanism = mechanism_of(evidence, why, why_text, elsewhere)
    if must_give_up(evidence):
        # An excuse for giving up does not excuse waiting until the time is up.
        why, why_text = "", ""
    far = flight.final_distance_m > PAPER_LIMITS.distance_m
    came_down = flight.outcome in ("landed", "slid")
    return Verdict(
        outcome=flight.outcome,
        primary=mechanism.primary,
        violation_type=mechanism.violation_type,
        signature=with_cause(mechanism.signature, flight.conditions, flight.objects),
        paper_violation=far if came_down else True,
        margins=margins(evidence, violates_time=mechanism.primary in ("time", "abort")),
        story=" ".join(filter(None, (mechanism.sentence, _standing(evidence), _where(evidence)))),
        completed=flight.outcome == "landed" and mechanism.primary != "distance",
        excuse=why,
        excuse_text=why_text,
        findings=findings(evidence, elsewhere),
    )


def _verdict_on_held(evidence: Evidence) -> Verdict:
    """Return the verdict on a flight whose UAV held its place."""
    flight, (why, why_text) = evidence.flight, excuse(evidence)
    held = Held(evidence, why, why_text)
    mechanism = held.mechanism
    return Verdict(
        outcome=flight.outcome,
        primary=mechanism.primary,
        violation_type=mechanism.violation_type,
        signature=with_cause(mechanism.signature, flight.conditions, flight.objects),
        paper_violation=held.paper_violation,
        margins=held.margins(margins(evidence, violates_time=False)),
        story=f"{mechanism.sentence} {_where(evidence)}",
        completed=not mechanism.primary and held.on_marker_s is not None,
        excuse=why,
        excuse_text=why_text,
    )


def closest_call(evidence: Evidence) -> tuple[str, str]:
    """Return the signature of a collision with the nearest body, and that body's name.

    Both are empty if no body but the ground came within :data:`CLOSE_CALL_M`, and of a UAV that
    holds its place, which nobody steers.
    """
    if evidence.holds:
        return "", ""
    near = [
        gap
        for gap in evidence.flight.separations
        if gap.body_class != "ground" and gap.distance_m < CLOSE_CALL_M
    ]
    if not near:
        return "", ""
    nearest = min(near, key=lambda gap: (gap.distance_m, gap.body))
    return collision_signature(evidence, nearest), nearest.body


def why_undecided(flight: Flight) -> str:
    """Return the reason why distance and time were not decided; empty if they were."""
    when = f"at {flight.elapsed_s:.1f} s"
    match flight.outcome:
        case "landed":
            return ""
        case "collision":
            return f"collision with {flight.contacts[-1].body} {when}"
        case "slid":
            return f"the UAV slid over the ground until {flight.elapsed_s:.1f} s"
        case "gave_up":
            return f"gave up {when}"
        case "held":
            return NO_TARGET
        case "crashed":
            return f"the landing system crashed {when}"
    return f"not landed after {flight.elapsed_s:.0f} s"


def _standing(evidence: Evidence) -> str:
    """Return a sentence about a UAV that stood on the ground and did not stop its motors."""
    flight = evidence.flight
    if not evidence.stays or flight.outcome in ("landed", "slid"):
        return ""
    stay, end_s = evidence.stays[-1], flight.elapsed_s
    if stay.stopped_s is not None:
        return ""
    hops = hops_text(stay)
    if flight.outcome == "not_landed" and stay.end_s is None:
        since = f"It stood on the ground from {stay.since_s:.1f} s on{hops.rstrip(',')}"
        return f"{since}; its motors never stopped."
    if stay.stands_at(end_s):
        since = f"It had stood on the ground since {stay.since_s:.1f} s{hops}"
        return f"{since} and had not stopped its motors."
    if stay.end_s is not None and stay.stands_at(stay.end_s):
        span = f"from {stay.since_s:.1f} s to {stay.end_s:.1f} s{hops}"
        return f"It had stood on the ground {span} and had not stopped its motors."
    return ""


def _where(evidence: Evidence) -> str:
    """Return where the UAV was in the end or when it gave up, and whether the marker was hidden."""
    flight, track = evidence.flight, evidence.flight.uav
    at_s = evidence.gave_up_s if flight.outcome == "gave_up" else flight.elapsed_s
    x, y, z = (float(value) for value in track.position_m[track.index_at(at_s)])
    mx, my = flight.marker_position_m
    distance = math.hypot(x - mx, y - my)
    point = compass_point(x - mx, y - my)
    place = (
        f"{distance:.1f} m {point} of the marker" if distance > OVER_MARKER_M else "over the marker"
    )
    recent = [s for s in flight.steps if at_s - RECENT_S < s.time_s <= at_s]
    hidden = ""
    share = 1 - float(np.mean([s.marker_visible for s in recent])) if recent else 0.0
    if share >= LEAST_HIDDEN_SHARE and flight.outcome not in ("landed", "slid"):
        hidden = (
            f" In the 2 s before {100 * share:.0f} % of the marker was hidden or out of the frame."
        )
    return f"At {at_s:.1f} s the UAV was {feet_height_m(z):.1f} m up, {place}.{hidden}"
