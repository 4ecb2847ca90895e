"""The facts of a flight, each derived once: what verdicts, margins, stories and pages ask for.

Ground truth decides types: a marker counts as seen in a frame in which it can be read.  Reports
of the landing system only add to the text.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pytest_garl.flight.detectability import READABLE, readable_probability
from pytest_garl.flight.flight import HOLDS, Contact, Flight, Step, Touchdown
from pytest_garl.flight.thresholds import SLID_M
from pytest_garl.verdicts.touchdowns import Stay, off_in_track, stays_of
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS, NO_LANDING, Limits

AT_MARKER_M = 1.5
"""A detection or target within this distance of the marker is the marker: the length of its side.
"""
IN_VIEW_SHARE = 0.5
"""Without a record of how a picture shows the marker, it counts as seen from this share on."""
UNSEEN_S = 2.0
"""An object counts as seen if it was in the frame this long before."""
LAST_METRE_M = 1.2
"""Body height at which the feet are one metre above the ground."""
NEAR_MARKER_M = 2.5
"""Horizontal distance from the marker within which a high UAV is on approach."""
LOW_M = 7.0
"""Height at which a take-off ends at the latest; a UAV that sinks below it is in its descent."""
SUNK_M = 0.5
"""A UAV that is this far below its highest place so far has turned to come down; less is bobbing.
NPCs wait for the same difference (``landing_moments.DESCENT_HYSTERESIS_M``)."""
LEVEL_S = 2.0
"""A UAV that rose less than that in this time before the flight's end had stopped climbing: it was
slower than 0.25 m/s, and the flight control climbs at up to 3 m/s."""
AIRBORNE_M = 1.0
"""Body height from which a UAV has taken off; one that starts higher hovers at its start."""
Place = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """What the landing system reports with one camera frame.

    ``off_m`` is how far from the marker the nearest detection is, None if it reports none;
    ``target_m`` is the place (x, y) in the world of its target, None if it names none.
    """

    step: Step
    off_m: float | None
    target_m: Place | None

    @property
    def detects(self) -> bool:
        """Whether it reports a detection."""
        return self.off_m is not None

    @property
    def marker(self) -> bool:
        """Whether it reports a detection at the marker's place."""
        return self.off_m is not None and self.off_m <= AT_MARKER_M

    @property
    def elsewhere(self) -> bool:
        """Whether it reports detections, and none of them at the marker."""
        return self.detects and not self.marker


@dataclass(frozen=True, eq=False)
class Evidence:
    """The facts of one flight; ``limits`` say which touchdowns are off the marker."""

    flight: Flight
    limits: Limits = DEFAULT_LIMITS

    @cached_property
    def holds(self) -> bool:
        """Whether the UAV held its place, so that nothing which the system commanded was flown."""
        return any(event.name == HOLDS for event in self.flight.events)

    @cached_property
    def hit(self) -> Contact | None:
        """The contact of a collision; None for any other flight."""
        flight = self.flight
        return flight.contacts[-1] if flight.outcome == "collision" and flight.contacts else None

    @cached_property
    def said_abort_s(self) -> float | None:
        """When the system gave the landing up; None if it never did."""
        return next((e.time_s for e in self.flight.events if e.name == "abort_command"), None)

    @cached_property
    def gave_up_s(self) -> float:
        """When the landing was given up: at the command, or when the time was over."""
        return self.flight.elapsed_s if self.said_abort_s is None else self.said_abort_s

    @property
    def waited(self) -> bool:
        """Whether the time was up without a landing, and nothing had been given up."""
        return self.flight.outcome == "not_landed" and self.said_abort_s is None

    @cached_property
    def decided_s(self) -> float:
        """When the event happened that decided the flight; the end if nothing tells it."""
        if self.hit:
            return self.hit.time_s
        if self.flight.outcome in ("landed", "slid") and self.flight.touchdown:
            return self.flight.touchdown.time_s
        return self.gave_up_s

    # On the ground.

    @cached_property
    def stays(self) -> tuple[Stay, ...]:
        """The stays on the ground, in order; empty for simulators without touchdowns."""
        return stays_of(self.flight)

    @cached_property
    def landed_s(self) -> float:
        """The time of the touchdown; the flight's end for simulators that record none.

        A UAV that landed with hops had come down with the first one.
        """
        if self.flight.touchdown is None:
            return self.flight.elapsed_s
        return self.stays[-1].since_s if self.stays else self.flight.touchdown.time_s

    def stands_since_s(self, time_s: float) -> float | None:
        """Return since when the UAV stands with running motors at a time; None if it does not."""
        return next((each.since_s for each in self.stays if each.stands_at(time_s)), None)

    @cached_property
    def touchdown_off_marker(self) -> Touchdown | None:
        """The first touchdown beyond the limit that was not a landing; None if there was none.

        The UAV took off again, slid on, gave up, or was hit where it stood.  None as well if it had
        come down within the limit and was dragged beyond it before.
        """
        if not self.stays and self.flight.outcome in NO_LANDING:
            return off_in_track(self.flight, self.limits.distance_m)
        return self._first_off if isinstance(self._first_off, Touchdown) else None

    @cached_property
    def dragged(self) -> Stay | None:
        """The stay that began within the limit and in which the UAV slid; None without one.

        It slid by the simulator's outcome, or moved by more than that limit of a slide to beyond
        the limit of distance, hops included.
        """
        return self._first_off if isinstance(self._first_off, Stay) else None

    @cached_property
    def _first_off(self) -> Touchdown | Stay | None:
        """The first touchdown beyond the limit, or the stay that was dragged before it."""
        limit_m = self.limits.distance_m
        landing = self.flight.touchdown if self.flight.outcome == "landed" else None
        for stay in self.stays:
            slid = self.flight.outcome == "slid" and stay is self.stays[-1]
            went_off = slid or stay.farthest_m > limit_m
            if stay.first.distance_m <= limit_m and went_off and stay.moved_m > SLID_M:
                return stay
            for each in stay.touchdowns:
                if each.distance_m > limit_m and each is not landing:
                    return each
        return None

    @cached_property
    def off_marker_m(self) -> float | None:
        """The distance from the marker at which the UAV came down; None if it did not.

        A landing that was given up came down if it touched the ground beyond the limit.
        """
        if self.touchdown_off_marker:
            return self.touchdown_off_marker.distance_m
        if self.dragged:
            return self.dragged.farthest_m
        return self.flight.final_distance_m if self.flight.outcome == "landed" else None

    def decoy_at(self, place: Place) -> str:
        """Return the name of the decoy at a place; empty if none is there."""
        near = ((math.dist(place, decoy), name) for name, *decoy in self.flight.decoys)
        distance_m, name = min(near, default=(math.inf, ""))
        return name if distance_m <= AT_MARKER_M else ""

    # The phases of the landing.  A flight's own heights divide it: where it stopped climbing, and
    # from where it came down.  So a UAV that searches at 4 m, turns in during its climb or starts
    # in the air has the same phases as one that searches at 10 m.

    @cached_property
    def flying_from(self) -> int:
        """The first sample of the track after the take-off; its length if there is none.

        The take-off ends where the UAV stops climbing: half a metre below the highest place from
        which it first came down by as much, or at 7 m.  A UAV that starts in the air has none, and
        a flight that ended during its climb is all take-off.
        """
        heights, times = self.flight.uav.position_m[:, 2], self.flight.uav.time_s
        if heights[0] >= AIRBORNE_M:
            return 0
        highest = np.maximum.accumulate(heights)
        turned = (highest - heights >= SUNK_M) & (highest >= AIRBORNE_M)
        top_m = float(highest[np.argmax(turned)] if turned.any() else highest[-1])
        end = int(np.argmax(heights >= min(LOW_M, top_m - SUNK_M)))
        levelled = turned.any() or top_m >= LOW_M or times[-1] - times[end] >= LEVEL_S
        return end if levelled and top_m >= AIRBORNE_M else len(heights)

    def height_m(self, time_s: float) -> float:
        """Return the height of the UAV above the place of its start."""
        uav = self.flight.uav
        return float(uav.position_m[uav.index_at(time_s), 2])

    def climbs_mps(self, time_s: float) -> float:
        """Return the vertical speed over the tenth of a second before a time."""
        uav = self.flight.uav
        end = uav.index_at(time_s)
        start = min(uav.index_at(time_s - 0.1), max(0, end - 1))
        lasted_s = float(uav.time_s[end] - uav.time_s[start])
        risen_m = float(uav.position_m[end, 2] - uav.position_m[start, 2])
        return risen_m / lasted_s if lasted_s else 0.0

    def phase_at(self, time_s: float) -> str:
        """Return the phase: take-off, transit, search, approach, descent, last-metre, standing.

        A UAV that holds its place has one alone: hold.
        """
        if self.holds:
            return "hold"
        flight = self.flight
        index = flight.uav.index_at(time_s)
        x, y, z = (float(value) for value in flight.uav.position_m[index])
        if index < self.flying_from:
            return "take-off"
        if self.stands_since_s(time_s) is not None:
            return "standing"
        if z <= LAST_METRE_M:
            return "last-metre"
        highest_m = float(flight.uav.position_m[: index + 1, 2].max())
        if z < min(LOW_M, highest_m - SUNK_M):
            return "descent"
        if math.dist((x, y), flight.marker_position_m) < NEAR_MARKER_M:
            return "approach"
        seen = any(step.marker_visible > 0 for step in flight.steps if step.time_s <= time_s)
        return "search" if seen else "transit"

    # What there was to see.

    @cached_property
    def readable(self) -> tuple[Step, ...]:
        """The frames in which the marker could be read, from ground truth.

        Simulators that do not record how a frame shows the marker are judged by its visible share.
        """
        steps = self.flight.steps
        if any(step.marker is not None for step in steps):
            return tuple(s for s in steps if readable_probability(s.marker) >= READABLE)
        return tuple(step for step in steps if step.marker_visible > IN_VIEW_SHARE)

    def readable_until(self, time_s: float) -> list[Step]:
        """Return the frames up to a time in which the marker could be read."""
        return [step for step in self.readable if step.time_s <= time_s]

    @property
    def readable_s(self) -> float:
        """For how long the marker could be read in the frames of the flight until it gave up."""
        return len(self.readable_until(self.gave_up_s)) * self.frame_s

    @property
    def frame_s(self) -> float:
        """The time between two frames; 0 if there were not two."""
        times = [step.time_s for step in self.flight.steps[:2]]
        return times[1] - times[0] if len(times) == 2 else 0.0

    @cached_property
    def expected_readable_s(self) -> float:
        """For how long a nominal landing could read the marker at best, by expectation.

        A nominal landing may wait and try again; its best attempt counts.
        """
        attempts: dict[int, list[float]] = {}
        for each in self.flight.nominal_views:
            expected_s = each.duration_s * readable_probability(each.marker)
            attempts.setdefault(each.attempt, []).append(expected_s)
        return max((math.fsum(each) for each in attempts.values()), default=0.0)

    def was_in_view(self, body: str, time_s: float) -> bool:
        """Whether the camera showed a dynamic object within two seconds before ``time_s``."""
        return any(
            body in step.objects_visible
            for step in self.flight.steps
            if time_s - UNSEEN_S <= step.time_s <= time_s
        )

    # What the landing system reports.

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """What the system reports with each frame; it reports in its own frame of reference."""
        return tuple(self._report(step) for step in self.flight.steps)

    def _report(self, step: Step) -> Report:
        found = step.diagnostics.detections if step.diagnostics else ()
        marker_m = self.flight.marker_position_m
        places = (_in_world(step, each.position_m) for each in found)
        return Report(
            step=step,
            off_m=min((math.dist(place, marker_m) for place in places), default=None),
            target_m=target_of(step),
        )

    @cached_property
    def reports_detections(self) -> bool:
        """Whether the diagnostics of any step hold a detection."""
        return any(each.detects for each in self.reports)

    @cached_property
    def targets(self) -> tuple[tuple[float, Place], ...]:
        """When the system reports a target, and where (x, y) in the world it is."""
        return tuple((r.step.time_s, r.target_m) for r in self.reports if r.target_m)

    @property
    def reports_anything(self) -> bool:
        """Whether the diagnostics of any step hold a detection or a target."""
        return self.reports_detections or bool(self.targets)

    @cached_property
    def reporting(self) -> tuple[Step, ...]:
        """The frames in which the system reports the marker at its place.

        By a detection; of a system that reports none, by a target.
        """
        if self.reports_detections:
            return tuple(each.step for each in self.reports if each.marker)
        return tuple(each.step for each in self.reports if self._is_at_marker(each.target_m))

    def _is_at_marker(self, place: Place | None) -> bool:
        return place is not None and math.dist(place, self.flight.marker_position_m) <= AT_MARKER_M

    def last_target(self, until_s: float) -> Place | None:
        """Return the last target (x, y) that the system reported up to a time."""
        return next((place for time_s, place in self.targets[::-1] if time_s <= until_s), None)

    def last_report_s(self, until_s: float) -> float | None:
        """Return when the system last reported the marker at its place up to a time, or None."""
        times = (step.time_s for step in self.reporting)
        return max((time_s for time_s in times if time_s <= until_s), default=None)

    @cached_property
    def undetected(self) -> tuple[float, float]:
        """For how long the marker could be read without being reported, and since when.

        Longest span of frames in a row.  It is 0 for a system that reports no detections.
        """
        longest, began, since = 0.0, 0.0, None
        if not self.reports_detections:
            return longest, began
        # A system that gave up is not asked any more.
        readable = {step.time_s for step in self.readable_until(self.gave_up_s)}
        for report in self.reports:
            time_s = report.step.time_s
            if time_s in readable and not report.marker:
                since = time_s if since is None else since
                if time_s - since > longest:
                    longest, began = time_s - since, since
            else:
                since = None
        return longest, began


def target_of(step: Step) -> Place | None:
    """Return the place (x, y) in the world that the system reports as its target, None if none.

    The system reports it in its own frame, so the error of its position is subtracted.
    """
    target = step.diagnostics.target_m if step.diagnostics else None
    return _in_world(step, target) if target else None


def _in_world(step: Step, place: tuple[float, ...]) -> Place:
    error = step.estimation_error_m
    return place[0] - error[0], place[1] - error[1]
