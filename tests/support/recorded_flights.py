"""Records of flights that nobody flew, for what reads records."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_garl.flight.flight import (
    TRACK_RATE_HZ,
    Contact,
    Event,
    Flight,
    MarkerView,
    Step,
    Track,
)
from pytest_garl.landing_system import Detection, Diagnostics

END_S = 10.0
READABLE = MarkerView(
    share_in_frame=1.0,
    px_per_module=8.0,
    border_hidden=0.0,
    bits_hidden=0.0,
    contrast=150.0,
    noise=2.0,
    blur_px=0.0,
)


def hit_by_dog(time_s: float) -> Contact:
    """Return a contact with a dog, a metre up."""
    return Contact(
        time_s=time_s,
        body="dog-1",
        kind="dog",
        body_class="dynamic",
        position_m=(0.0, 0.0, 1.0),
        speed_mps=2.0,
        tilt_rad=0.0,
    )


def seen(
    frames: Collection[int],
    *,
    reported: Collection[int] = (),
    place: tuple[float, float, float] = (0.0, 0.0, 0.0),
    count: int = 100,
) -> tuple[Step, ...]:
    """Return ten camera frames a second: in some the marker is readable, in some reported."""
    found = Detection(marker_id=0, confidence=0.9, position_m=place)
    return tuple(
        Step(
            time_s=index / 10,
            command="PositionSetpoint",
            marker_visible=1.0 if index in frames else 0.0,
            marker_px=50.0,
            objects_visible=(),
            diagnostics=Diagnostics(detections=(found,)) if index in reported else None,
            marker=READABLE if index in frames else None,
        )
        for index in range(count)
    )


def recorded(
    *,
    steps: tuple[Step, ...],
    outcome: Any = "gave_up",
    given_up_s: float | None = None,
    end_s: float = END_S,
    places: NDArray[np.float64] | None = None,
    **fields: Any,
) -> Flight:
    """Return a flight that hovers at 9 m, or is at these places, one for each sample."""
    if places is None:
        places = np.tile([0.0, 0.0, 9.0], (int(END_S * TRACK_RATE_HZ) + 1, 1))
    count = len(places)
    track = Track(
        time_s=np.arange(count) / TRACK_RATE_HZ,
        position_m=np.asarray(places, np.float64),
        attitude=np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)),
        velocity_mps=np.zeros((count, 3)),
    )
    events: tuple[Event, ...] = ()
    if given_up_s is not None:
        events = (Event(time_s=given_up_s, name="abort_command", text="the system said Abort()"),)
    values: dict[str, Any] = {"objects": (), "contacts": (), "separations": ()}
    return Flight(
        outcome=outcome,
        final_distance_m=1.0,
        elapsed_s=end_s,
        marker_position_m=(0.0, 0.0),
        uav=track,
        events=events,
        steps=steps,
        **{**values, **fields},
    )
