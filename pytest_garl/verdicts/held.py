"""Judge a flight whose UAV held its place: by what the system saw and planned, not by a landing.

The paper's research question 3 reproduces violations with a UAV that hovers: the landing system
perceives and plans, nothing of it is flown, and obstacles move.  What goes wrong is read from the
diagnostics and compared with ground truth:

- I and off: for half a second its target is beyond the limit of distance from the marker.
- II: it does not report a marker that can be read for three seconds.
- IV: for half a second its plans lead through a body that it could know (``held_plans.py``).
- V: it raises, gives up though it could land, or had a plan and has none for two seconds, while
  nobody is near the marker.

The first of these decides.  Whoever waits while somebody stands on the marker is right, and that is
no violation here; the paper's definition counts it, because its planner gives an error.  A system
that reports nothing is not judged.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pytest_garl.verdicts.evidence import AT_MARKER_M, Evidence, Place, Report
from pytest_garl.verdicts.excuses import in_cylinder
from pytest_garl.verdicts.findings import UNDETECTED_S
from pytest_garl.verdicts.held_plans import LASTS_S, Plans, first_span, windows_of
from pytest_garl.verdicts.mechanism import Mechanism
from pytest_garl.verdicts.verdict import Excuse, Margin, MarginName

NO_PLAN_S = 2.0
"""A planner that had a plan has ended after this time without one: MM-MLS waits for one second
after the last thing has moved below it, and plans ten times a second."""
AWAY_M = AT_MARKER_M
"""A plan that ends nearer to the UAV leads nowhere: whoever has nothing to fly plans no more."""
SETTLED_S = 2.0
"""After a jump of its position a system finds the marker again in less than this time; until then
its memory of the target is where that was."""
NO_TARGET = "the UAV held its place, and the marker was never the system's target"
NO_PLAN = "the UAV held its place, and the system reported no planned path"
NOTHING_REPORTED = (
    "the UAV held its place, and the system reported nothing that can be judged: return commands "
    "with Diagnostics(planned_path_m=..., target_m=..., detections=...); a program that speaks "
    "MAVLink sends LANDING_TARGET"
)
"""Why properties of such a flight are not decided."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Wrong:
    """Something that went wrong, and when it had lasted for long enough."""

    at_s: float
    mechanism: Mechanism


@dataclass(frozen=True, eq=False)
class Held:
    """What a flight whose UAV held its place shows; ``why`` is the excuse if it gave up."""

    evidence: Evidence
    why: Excuse = ""
    why_text: str = ""

    @cached_property
    def plans(self) -> Plans:
        """The plans of the system until it gave up."""
        return Plans(self.evidence.flight, tuple(each.step for each in self._reports))

    @cached_property
    def _reports(self) -> tuple[Report, ...]:
        gave_up_s = self.evidence.gave_up_s
        return tuple(each for each in self.evidence.reports if each.step.time_s <= gave_up_s)

    @cached_property
    def reports_plans(self) -> bool:
        """Whether the system reports a plan with any frame."""
        return bool(self.plans.planned.any())

    @property
    def reports_anything(self) -> bool:
        """Whether there is anything to judge: a plan, a target or a detection."""
        return self.reports_plans or self.evidence.reports_anything

    @property
    def could_report(self) -> bool:
        """Whether the marker could be read for so long that who sees it reports it.

        A system that looks at no picture could report at any time.
        """
        read = self.evidence.flight.data_read
        if read is not None and "image" not in read:
            return True
        return first_span(self.plans.times_s, self._readable, UNDETECTED_S) is not None

    @cached_property
    def _readable(self) -> NDArray[np.bool_]:
        """Whether the marker could be read in each frame."""
        times = {each.time_s for each in self.evidence.readable_until(self.evidence.gave_up_s)}
        return np.array([each.step.time_s in times for each in self._reports], np.bool_)

    @cached_property
    def off_marker_m(self) -> float | None:
        """The largest distance from the marker beyond which the target stayed for half a second.

        None for a system that reports no target for so long.
        """
        windows = windows_of(self.plans.times_s, self._off_m, LASTS_S)
        least = [float(off.min()) for off in windows if not np.isnan(off).any()]
        return max(least, default=None)

    @cached_property
    def _off_m(self) -> NDArray[np.float64]:
        """The distance of the target from the marker in each frame.

        NaN without a target, and shortly after the error of the system's position has changed by
        more than the limit.
        """
        targets = (each.target_m for each in self._reports)
        off_m = [math.dist(each, self._marker_m) if each else math.nan for each in targets]
        errors = np.array([each.step.estimation_error_m[:2] for each in self._reports])
        times = self.plans.times_s
        before = np.searchsorted(times, times - SETTLED_S)
        changed_m = [
            float(np.ptp(errors[start : end + 1], axis=0).max())
            for end, start in enumerate(before.tolist())
        ]
        settled = np.array(changed_m) <= self.evidence.limits.distance_m
        return np.where(settled, np.array(off_m), math.nan)

    @cached_property
    def on_marker_s(self) -> float | None:
        """When the system first had a plan for the marker, None if it never had.

        For a system that reports no plans: when the marker was its target.
        """
        on = self._off_m <= self.evidence.limits.distance_m
        if self.reports_plans:
            on &= self.plans.planned
        return float(self.plans.times_s[int(on.argmax())]) if on.any() else None

    @property
    def through(self) -> tuple[str, ...]:
        """Names of the bodies through which plans led."""
        return tuple(each.item.name for each in self.plans.through)

    # The mistakes, and the first of them.

    @cached_property
    def mechanism(self) -> Mechanism:
        """The first violation, or how the flight ended without one."""
        wrong = (
            *self._through_bodies(),
            *self._off_target(),
            *self._unseen(),
            *self._late(),
            *self._ended(),
        )
        first = min(wrong, key=lambda each: each.at_s, default=None)
        return first.mechanism if first else Mechanism(sentence=self._sentence())

    @property
    def paper_violation(self) -> bool:
        """Whether the paper counts it: its planner's error counts if somebody is in the way too."""
        return bool(self.mechanism.primary) or self._gap(clear=False) is not None

    def _through_bodies(self) -> Iterator[_Wrong]:
        for each in self.plans.through:
            sight = {True: ":seen", False: ":unseen", None: ""}[each.seen]
            reported = {
                True: "; it reported an obstacle there",
                False: "; it reported no obstacle there",
                None: "",
            }[each.seen]
            yield _Wrong(
                at_s=each.since_s + LASTS_S,
                mechanism=Mechanism(
                    primary="collision",
                    violation_type="IV",
                    signature=f"IV:{each.item.type}:plan{sight}",
                    sentence=(
                        f"From {each.since_s:.1f} s to {each.until_s:.1f} s its plans led through "
                        f"{each.item.name}, which had been in view for {each.in_view_s:.1f} s"
                        f"{reported}."
                    ),
                ),
            )

    def _off_target(self) -> Iterator[_Wrong]:
        evidence, limit_m = self.evidence, self.evidence.limits.distance_m
        span = first_span(self.plans.times_s, self._off_m > limit_m, LASTS_S)
        if span is None:
            return
        since_s, until_s = span
        places = [(t, place) for t, place in evidence.targets if since_s <= t <= until_s]
        at_s, place = max(places, key=lambda each: math.dist(each[1], self._marker_m))
        off_m, thing = math.dist(place, self._marker_m), self._thing_at(place, at_s)
        far = off_m > max(AT_MARKER_M, limit_m)
        what = f", {thing}" if far and thing else ""
        yield _Wrong(
            at_s=since_s + LASTS_S,
            mechanism=Mechanism(
                primary="distance",
                violation_type="I" if far else "off",
                signature=f"I:{_kind(thing) or 'nothing'}:hold" if far else "off:hold",
                sentence=(
                    f"From {since_s:.1f} s to {until_s:.1f} s its target was up to {off_m:.1f} m "
                    f"off the marker{what}."
                ),
            ),
        )

    def _unseen(self) -> Iterator[_Wrong]:
        """Yield that a marker which could be read for long enough was not reported."""
        evidence = self.evidence
        longest_s, began_s = evidence.undetected
        if not evidence.reports_detections:
            silent = np.array([each.target_m is None for each in self._reports], np.bool_)
            span = first_span(self.plans.times_s, self._readable & silent, UNDETECTED_S)
            if span and self.reports_anything:
                began_s, longest_s = span[0], span[1] - span[0]
        if longest_s < UNDETECTED_S:
            return
        before = [step for step in evidence.reporting if step.time_s < began_s]
        name = "lost" if before else "never-seen"
        yield _Wrong(
            at_s=began_s + UNDETECTED_S,
            mechanism=Mechanism(
                primary="time",
                violation_type="II",
                signature=f"II:{name}:hold",
                sentence=(
                    f"From {began_s:.1f} s on the marker could be read for {longest_s:.1f} s, but "
                    "the system did not report it."
                ),
            ),
        )

    def _late(self) -> Iterator[_Wrong]:
        on_s = self.on_marker_s
        if on_s is not None and on_s > self.evidence.limits.time_s:
            yield _Wrong(
                at_s=on_s,
                mechanism=Mechanism(
                    primary="time",
                    violation_type="late",
                    signature="late:planned:hold",
                    sentence=f"Had the marker as its target late, after {on_s:.1f} s.",
                ),
            )

    def _ended(self) -> Iterator[_Wrong]:
        """Yield that the planner has ended: without a plan, or because the system gave up."""
        gap = self._gap(clear=True)
        if gap is not None:
            since_s, until_s = gap
            yield _Wrong(
                at_s=since_s + NO_PLAN_S,
                mechanism=Mechanism(
                    primary="time",
                    violation_type="V",
                    signature="V:no-plan:hold",
                    sentence=(
                        f"From {since_s:.1f} s to {until_s:.1f} s it had no plan, although it had "
                        f"had one and nobody was near the marker.{self._note(until_s)}"
                    ),
                ),
            )
        evidence, rule = self.evidence, self.evidence.limits.abort
        if evidence.said_abort_s is None or rule == "ok" or (self.why and rule == "needless"):
            return
        text = f" {self.why_text}" if self.why else self._note(evidence.gave_up_s)
        yield _Wrong(
            at_s=evidence.gave_up_s,
            mechanism=Mechanism(
                primary="abort" if rule == "violation" else "time",
                violation_type="abort" if self.why else "V",
                signature=f"abort:{self.why}" if self.why else "V:gave-up:hold",
                sentence=f"Gave up at {evidence.gave_up_s:.1f} s.{text}",
            ),
        )

    def _gap(self, *, clear: bool) -> tuple[float, float] | None:
        """Return the first time without a plan after one that led away.

        ``clear`` asks for one in which nobody was near the marker.
        """
        plans = self.plans
        missing = ~plans.planned & (plans.last_reach_m > AWAY_M)
        if clear:
            missing &= ~self._occupied
        return first_span(plans.times_s, missing, NO_PLAN_S)

    @cached_property
    def _occupied(self) -> NDArray[np.bool_]:
        """Whether a body was in the marker's safety cylinder at each frame."""
        flight, times = self.evidence.flight, self.plans.times_s
        index = np.maximum(0, np.searchsorted(flight.uav.time_s, times, side="right") - 1)
        occupied = np.zeros(len(times), np.bool_)
        for item in flight.objects:
            occupied |= in_cylinder(item, flight.marker_position_m)[index]
        return occupied

    # Words.

    @property
    def _marker_m(self) -> Place:
        return self.evidence.flight.marker_position_m

    def _sentence(self) -> str:
        if hit := self.evidence.hit:
            return f"{hit.body} met the UAV, which held its place."
        if not self.reports_anything:
            why = "" if self.could_report else ", and the marker could not be read for long enough"
            return f"Held its place; the system reported no plan, no target and no detection{why}."
        gap = self._gap(clear=False)
        if gap:
            since_s, until_s = gap
            return (
                f"Held its place. From {since_s:.1f} s to {until_s:.1f} s it had no plan while "
                f"somebody was near the marker.{self._note(until_s)}"
            )
        if self.on_marker_s is None:
            return "Held its place; the marker was never its target."
        what = "had a plan for the marker" if self.reports_plans else "had the marker as its target"
        return f"Held its place; from {self.on_marker_s:.1f} s on it {what}."

    def _note(self, time_s: float) -> str:
        """Return what the system said up to a time last; empty if it said nothing."""
        notes = [
            each.step.diagnostics.note
            for each in self._reports
            if each.step.time_s <= time_s and each.step.diagnostics
        ]
        return f" It said: {notes[-1]}." if notes and notes[-1] else ""

    def _thing_at(self, place: Place, time_s: float) -> str:
        """Return the name of the decoy or the body at a place; empty if nothing is there."""
        if name := self.evidence.decoy_at(place):
            return name
        near = []
        for item in self.evidence.flight.objects:
            x, y = (float(each) for each in item.track.position_m[item.track.index_at(time_s), :2])
            near.append((math.dist(place, (x, y)), item.name))
        distance_m, name = min(near, default=(math.inf, ""))
        return name if distance_m <= AT_MARKER_M else ""

    # Margins.

    def margins(self, flown: tuple[Margin, ...]) -> tuple[Margin, ...]:
        """Return the margins of such a flight; those of the touchdown and the like stay."""
        limits, off_m, on_s = self.evidence.limits, self.off_marker_m, self.on_marker_s
        violates_time = self.mechanism.primary in ("time", "abort")
        left_s = limits.time_s - (self.evidence.flight.elapsed_s if on_s is None else on_s)
        gap_m = self.plans.separation_m
        targeted = off_m is not None
        own = {
            "distance": _margin("distance", limits.distance_m - (off_m or 0.0), "m", targeted),
            "time": _margin(
                "time",
                min(0.0, left_s) if violates_time else left_s,
                "s",
                violates_time or on_s is not None,
            ),
            "collision": _margin("collision", gap_m, "m", self.reports_plans, NO_PLAN),
            "moving": _margin("moving", gap_m, "m", self.reports_plans, NO_PLAN),
        }
        return tuple(own.get(each.property, each) for each in flown)


def _margin(
    name: MarginName, value: float, unit: str, decided: bool, why: str = NO_TARGET
) -> Margin:
    return Margin(
        property=name, value=value, unit=unit, decided=decided, reason="" if decided else why
    )


def _kind(name: str) -> str:
    """Return the kind of a body by its name: ``person`` of ``person-2``; a decoy keeps its own."""
    stem, _, number = name.rpartition("-")
    return stem if number.isdigit() else name
