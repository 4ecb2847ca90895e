"""Recorder of a flight: collects poses, contacts, events and steps while it is flown."""

from __future__ import annotations

import bisect
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pytest_garl.flight.flight import (
    OBSERVED,
    BodyClass,
    Contact,
    Crash,
    Event,
    Flight,
    MarkerView,
    ObjectRecord,
    Outcome,
    Separation,
    Step,
    Touchdown,
    Track,
)
from pytest_garl.landing_system import Command
from pytest_garl.scenarios.groups import DECIDED
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.story import MET
from pytest_garl.simulation.camera.frame import Frame
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.landing_moments import LandingMoments, moment_of
from pytest_garl.simulation.physics.npc import Npc

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameContent:
    """What a frame shows: the fields of ``Step`` of the same names."""

    marker_visible: float = 0.0
    marker_px: float = 0.0
    marker: MarkerView | None = None
    objects_visible: tuple[str, ...] = ()
    objects_px: tuple[int, ...] = ()


class Recorder:
    """Collects poses, contacts, events and steps; ``time_s`` is the flight's present time."""

    def __init__(self, placed: Placed, objects: Sequence[Npc]) -> None:
        self.time_s = 0.0
        self._objects, self._marker = objects, placed.marker_m
        self._decoys = tuple(
            (each.name, *each.points_m[0]) for each in placed.layers if each.kind == "marker"
        )
        self._kinds: dict[str, tuple[str, BodyClass]] = {"ground": ("ground", "ground")}
        self._kinds |= {body.name: (body.kind, "static") for body in placed.map.bodies}
        self._kinds |= {item.name: (item.type.name, "dynamic") for item in objects}
        self._times: list[float] = []
        self._uav: list[tuple[float, ...]] = []
        self._tracks: list[list[tuple[float, ...]]] = [[] for _ in objects]
        self._nearest: dict[str, tuple[float, float]] = {}
        self._contacts: list[Contact] = []
        self._events: list[Event] = []
        self._steps: list[Step] = []
        self._phase = ""
        self.moments = LandingMoments()
        self.data_read: set[str] = set()
        """Names of the data that the landing system read."""

    def begin(self, position: Vector, attitude: Quaternion, velocity: Vector) -> None:
        """Record the pose at time zero, so a flight that fails at its start has a track too."""
        self.pose(0.0, position, attitude, velocity, {})

    def pose(
        self,
        time_s: float,
        position: Vector,
        attitude: Quaternion,
        velocity: Vector,
        gaps: Mapping[str, float],
    ) -> None:
        """Add one sample to every track; a second one at the same time replaces the first."""
        if self._times and self._times[-1] == time_s:
            self._times.pop()
            self._uav.pop()
            for track in self._tracks:
                track.pop()
        self._times.append(time_s)
        self._uav.append((*position, *attitude, *velocity))
        for track, item in zip(self._tracks, self._objects, strict=True):
            turn = (0.0, 0.0, math.sin(item.yaw_rad / 2), math.cos(item.yaw_rad / 2))
            track.append((*item.position_m, *turn, *item.velocity_mps))
        for name, gap in gaps.items():
            if gap < self._nearest.get(name, (math.inf, 0.0))[0]:
                self._nearest[name] = (gap, time_s)

    def contact(self, body: str, position_m: Vector, speed_mps: float, tilt_rad: float) -> None:
        """Record a contact; ``Contacts`` decides whether it ends the flight."""
        kind, body_class = self._kinds[body]
        self._contacts.append(
            Contact(
                time_s=self.time_s,
                body=body,
                kind=kind,
                body_class=body_class,
                position_m=position_m,
                speed_mps=speed_mps,
                tilt_rad=tilt_rad,
            )
        )
        self.event("contact", f"touched {body} at {speed_mps:.1f} m/s")

    @property
    def last_contact(self) -> str | None:
        """Name of the body that the UAV touched last."""
        return self._contacts[-1].body if self._contacts else None

    @property
    def last_view(self) -> MarkerView | None:
        """What the latest picture that the landing system got shows of the marker."""
        return self._steps[-1].marker if self._steps else None

    def event(self, name: str, text: str, time_s: float | None = None) -> None:
        """Record an event of the present, or of an earlier time that is only now known for one."""
        event = Event(time_s=self.time_s if time_s is None else time_s, name=name, text=text)
        bisect.insort(self._events, event, key=lambda each: each.time_s)

    def content_of(self, frame: Frame, renderer: Renderer, eye: Vector) -> FrameContent:
        """Return what a frame shows of the marker and of the objects."""
        ids = renderer.segment_ids
        area = frame.marker_area_px
        names = [item.name for item in self._objects if frame.pixels[ids[item.name]]]
        return FrameContent(
            marker_visible=min(1.0, float(frame.pixels[ids["marker"]]) / area)
            if area >= 1
            else 0.0,
            marker_px=renderer.marker_side_px(max(0.1, eye[2])),
            marker=frame.marker,
            objects_visible=tuple(names),
            objects_px=tuple(int(frame.pixels[ids[name]]) for name in names),
        )

    def step(
        self,
        command: Command,
        content: FrameContent,
        error_m: Vector = (0.0, 0.0, 0.0),
        range_m: float | None = None,
    ) -> None:
        """Record one command of the landing system, with what its frame shows.

        ``error_m`` is the error of the position that the system got, ``range_m`` the reading
        of its rangefinder.
        """
        self.moments.see(self.time_s, content.marker)
        diagnostics = command.diagnostics
        if diagnostics and diagnostics.phase != self._phase:
            self._phase = diagnostics.phase
            self.event("phase", diagnostics.phase)
        self._steps.append(
            Step(
                time_s=self.time_s,
                command=type(command).__name__,
                marker_visible=content.marker_visible,
                marker_px=content.marker_px,
                objects_visible=content.objects_visible,
                diagnostics=diagnostics,
                marker=content.marker,
                objects_px=content.objects_px,
                estimation_error_m=error_m,
                rangefinder_m=range_m,
            )
        )

    def _of_npcs(self) -> Iterator[tuple[str, float]]:
        """Yield when each NPC could just meet the UAV, and when it was decided that it begins."""
        for item in self._objects:
            for moment, came_s in ((MET, item.met_s), (DECIDED, item.began_s)):
                if math.isfinite(came_s):
                    yield moment_of(moment, item.name), came_s

    def flight(
        self, outcome: Outcome, crash: Crash | None, touchdowns: Sequence[Touchdown]
    ) -> Flight:
        """Return the record; hash, CPU and versions are added by the caller."""
        times = np.array(self._times)
        x, y = self._uav[-1][:2]
        return Flight(
            outcome=outcome,
            final_distance_m=math.dist((x, y), self._marker),
            elapsed_s=self.time_s,
            marker_position_m=self._marker,
            uav=_track(times, self._uav),
            objects=tuple(
                ObjectRecord(
                    name=item.name,
                    type=item.type.name,
                    track=_track(times, samples),
                    moves=np.array(item.moves, dtype=np.float64).reshape(-1, 2),
                    changes=tuple(item.changes),
                )
                for item, samples in zip(self._objects, self._tracks, strict=True)
            ),
            contacts=tuple(self._contacts),
            separations=tuple(
                Separation(
                    body=name,
                    kind=self._kinds[name][0],
                    body_class=self._kinds[name][1],
                    distance_m=gap,
                    time_s=at,
                )
                for name, (gap, at) in sorted(self._nearest.items())
            ),
            events=tuple(self._events),
            steps=tuple(self._steps),
            decoys=self._decoys,
            crash=crash,
            touchdown=touchdowns[-1] if touchdowns else None,
            earlier_touchdowns=tuple(touchdowns[:-1]),
            data_read=tuple(name for name in OBSERVED if name in self.data_read),
            moments=(*self.moments.record, *self._of_npcs()),
        )


def _track(times: Any, samples: list[tuple[float, ...]]) -> Track:
    table = np.array(samples, dtype=np.float64)
    return Track(
        time_s=times,
        position_m=table[:, 0:3],
        attitude=table[:, 3:7],
        velocity_mps=table[:, 7:10],
    )
