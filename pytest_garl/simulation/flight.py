"""The record of one flight: everything that verdicts, objectives and reports need later."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from pytest_garl.landing_system import Diagnostics

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Outcome = Literal["landed", "collision", "not_landed", "aborted", "crashed"]
BodyClass = Literal["static", "dynamic", "ground"]

TRACK_RATE_HZ = 24.0
"""Rate of the recorded tracks: every tenth physics step."""
PACKAGES = ("pytest-garl", "numpy", "opencv-python-headless", "pybullet")
"""Packages whose versions determine the bytes of a flight."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Track:
    """Poses over time: ``time_s`` (n,), ``position_m`` (n, 3), ``attitude`` (n, 4), float64.

    The UAV's and the objects' tracks of one flight share their times.
    """

    time_s: NDArray[np.float64]
    position_m: NDArray[np.float64]
    attitude: NDArray[np.float64]
    velocity_mps: NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ObjectRecord:
    """Motion of one dynamic object: its track and its moves, one (x, y) per 0.5 s, (k, 2).

    ``changes`` are those of the environment that its policy asked for: the number of the
    decision, the gene, what was added to it.
    """

    name: str
    type: str
    track: Track
    moves: NDArray[np.float64]
    changes: tuple[tuple[int, str, float], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Contact:
    """A contact of the UAV: with which body, when, how fast.

    ``body`` is "dog-1", "tree-3" or "ground"; ``speed_mps`` the UAV's speed relative to it
    (for the ground the vertical speed), ``tilt_rad`` its tilt.
    """

    time_s: float
    body: str
    kind: str
    body_class: BodyClass
    position_m: tuple[float, float, float]
    speed_mps: float
    tilt_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Separation:
    """The smallest distance between the UAV's hull and one body over the flight."""

    body: str
    kind: str
    body_class: BodyClass
    distance_m: float
    time_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """Something worth telling: ``name`` is a stable word, ``text`` a sentence."""

    time_s: float
    name: str
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One camera frame: what there was to see and what the landing system made of it.

    ``marker_visible`` is the share (0..1) of the marker's area that this frame shows
    unhidden, where 0 means outside the frame or wholly covered; ``marker_px`` the
    side in pixels that an unhidden marker would have.  ``objects_visible`` names the
    dynamic objects of which at least one pixel is in the frame.
    """

    time_s: float
    command: str
    marker_visible: float
    marker_px: float
    objects_visible: tuple[str, ...]
    diagnostics: Diagnostics | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Crash:
    """An error of a landing system.

    ``kind`` is "raised", "nonsense" (a wrong return value), "died" (its process ended), "hung" or
    "broke" (the simulator fails with it and with no other); ``error`` the exception's type or the
    exit status; ``where`` the module and function that failed, as "planning_ego" or
    "MySystem.step".
    """

    kind: Literal["raised", "nonsense", "died", "hung", "broke"]
    error: str
    message: str
    where: str = ""
    traceback: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Flight:
    """One flight, complete.

    ``final_distance_m`` is horizontal, UAV to marker centre, at the end; ``elapsed_s`` is
    the simulated time since the mission's start.  ``decoys`` are other things on the
    ground that could be taken for the marker: (name, x, y).  ``sha256`` is the hash of
    the trajectories and the outcome, the same for equal flights on one CPU class;
    ``cpu`` names that class.  ``wall_s`` is what it cost and is in no hash.
    """

    outcome: Outcome
    final_distance_m: float
    elapsed_s: float
    marker_position_m: tuple[float, float]
    uav: Track
    objects: tuple[ObjectRecord, ...]
    contacts: tuple[Contact, ...]
    separations: tuple[Separation, ...]
    events: tuple[Event, ...]
    steps: tuple[Step, ...]
    decoys: tuple[tuple[str, float, float], ...] = ()
    crash: Crash | None = None
    sha256: str = ""
    cpu: str = ""
    versions: tuple[tuple[str, str], ...] = ()
    wall_s: float = field(default=0.0)
