"""The record of one flight: everything that verdicts, objectives and reports need later."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Literal

from pytest_garl.airframe import Rangefinder
from pytest_garl.landing_system import Diagnostics

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Outcome = Literal[
    "landed", "collision", "slid", "gave_up", "not_landed", "held", "crashed", "inconclusive"
]
"""How a flight ended; a simulator of a user's own may say that it came to no end.  A UAV has "held"
its place until the end if its start says so."""
HOLDS = "holds"
"""The event that begins the flight of a UAV that holds its place."""
BodyClass = Literal["static", "dynamic", "ground"]

TRACK_RATE_HZ = 24.0
"""Rate of the recorded tracks: every tenth physics step."""
OBSERVED = ("image", "depth_m", "rangefinder_m")
"""The fields of an observation of which a flight records whether they were read."""
_DISTRIBUTIONS = {"pybullet": ("pybullet", "pybullet-arm64"), "mujoco": ("mujoco-core", "mujoco")}
"""An engine is in the first of these that is installed; for most machines one has no wheel."""


def version_of(package: str) -> str:
    """Return the version of an installed package, or "absent"."""
    for name in _DISTRIBUTIONS.get(package, (package,)):
        try:
            return version(name)
        except PackageNotFoundError:
            continue
    return "absent"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Track:
    """Poses over time: ``time_s`` (n,), ``position_m`` (n, 3), ``attitude`` (n, 4), float64.

    The UAV's and the objects' tracks of one flight share their times.
    """

    time_s: NDArray[np.float64]
    position_m: NDArray[np.float64]
    attitude: NDArray[np.float64]
    velocity_mps: NDArray[np.float64]

    def index_at(self, time_s: float) -> int:
        """Return the last sample that is not later than a time; the first one before all."""
        return max(0, int(self.time_s.searchsorted(time_s, side="right")) - 1)


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
class MarkerView:
    """How a picture shows the marker, from ground truth: what decides whether it can be read.

    It is computed from the scene; no picture is painted for it.  ``share_in_frame`` is the share
    (0..1) of the marker that lies inside the picture, ``edge_modules`` the distance from the marker
    to the nearest edge of the picture in modules (bits), at most 1, negative where the edge cuts
    it, and ``px_per_module`` the side of a module in pixels along the shorter axis.
    ``border_hidden``, ``bits_hidden`` and ``margin_hidden`` are the shares of the black border, of
    the inner bits and of the white margin that objects, leaves or snow turn into the other colour:
    black under snow counts in full, white under snow does not count.  ``contrast`` is the
    difference between white and black modules in grey levels (0..255) as the sensor delivers them,
    after wetness, shadow, gloss, fog, dust and exposure; ``uneven_light`` the standard deviation of
    the light over the marker as a share of full light, so that the edge of a shadow counts;
    ``clutter`` the share of the picture that falling rain, snow and leaves are expected to cover
    between camera and marker; ``noise`` the standard deviation of a channel of a pixel in grey
    levels; ``blur_px`` the length of the motion blur.  Dirt on the lens lowers the contrast
    and makes the light uneven.
    """

    share_in_frame: float
    px_per_module: float
    border_hidden: float
    bits_hidden: float
    contrast: float
    noise: float
    blur_px: float
    margin_hidden: float = 0.0
    uneven_light: float = 0.0
    clutter: float = 0.0
    edge_modules: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class NominalView:
    """The marker as a level camera sees it from where a nominal landing looks.

    ``place`` is "search" for a place of the search above the mission's coordinate, or "above" for a
    place above the marker; ``height_m`` is that of the camera's UAV; ``time_s`` is when a nominal
    flight is there, and ``duration_s`` how long it looks from there.  ``attempt`` is 0 for the
    first landing; if it waits above the marker and comes down again, that has the next number.
    """

    time_s: float
    duration_s: float
    place: Literal["search", "above"]
    height_m: float
    marker: MarkerView
    attempt: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Touchdown:
    """The touchdown of a flight: the begin of its last stay on the ground.

    ``position_m`` is the body's; ``distance_m`` its horizontal distance from the marker's centre;
    ``speed_mps`` the vertical speed; ``on`` what lies under the UAV: "marker", the name of a decoy,
    "line", "shadow", or "nothing".  ``slid_m`` is how far from there it was on the ground at most
    afterwards, ``stopped_s`` the time at which the motors stopped, None if they did not.
    """

    time_s: float
    position_m: tuple[float, float, float]
    distance_m: float
    speed_mps: float
    tilt_rad: float
    on: str
    slid_m: float = 0.0
    stopped_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One camera frame: what there was to see and what the landing system made of it.

    ``time_s`` is when the landing system got it; a frame that is lost has no step.
    ``marker_visible`` is the share (0..1) of the marker's area that this frame shows
    unhidden, where 0 means outside the frame or wholly covered; ``marker_px`` the
    side in pixels that an unhidden marker would have; ``marker`` what decides whether it can be
    read, None without a camera or outside the frame.  ``objects_visible`` names the dynamic objects
    of which at least one pixel is in the frame, and ``objects_px`` counts their pixels, in the same
    order.  ``estimation_error_m`` is the difference between the position in the observation and the
    true one at the time of the picture; ``rangefinder_m`` the reading in the observation, None
    without one.
    """

    time_s: float
    command: str
    marker_visible: float
    marker_px: float
    objects_visible: tuple[str, ...]
    diagnostics: Diagnostics | None
    marker: MarkerView | None = None
    objects_px: tuple[int, ...] = ()
    estimation_error_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rangefinder_m: float | None = None


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
    ``touchdown`` is None for a flight that did not touch the ground after its take-off;
    ``earlier_touchdowns`` are those after which the UAV took off again, in order.
    ``nominal_views`` show how a nominal landing would have seen the marker, and would have seen it
    again while it waited, if the sight may change during the flight; they are empty for flights
    that landed, hit something or crashed, and for simulators that do not record them.
    ``nominal_arrival_s`` and ``nominal_landing_s`` are when a nominal flight is above the marker
    and on it.  ``rangefinder`` is the airframe's, None without one.  ``data_read`` names those of
    ``OBSERVED`` that the landing system read in any frame; None for simulators that do not record
    it.  ``conditions`` names what was not nominal in the scenario, such as ``fog`` or
    ``navigation``; empty for simulators that do not record it.  ``moments`` are the moments of the
    landing that came, and when; empty for simulators that do not record them.  The three are in no
    hash.
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
    touchdown: Touchdown | None = None
    earlier_touchdowns: tuple[Touchdown, ...] = ()
    nominal_views: tuple[NominalView, ...] = ()
    nominal_arrival_s: float | None = None
    nominal_landing_s: float | None = None
    rangefinder: Rangefinder | None = None
    data_read: tuple[str, ...] | None = None
    conditions: tuple[str, ...] = ()
    moments: tuple[tuple[str, float], ...] = ()
    sha256: str = ""
    cpu: str = ""
    versions: tuple[tuple[str, str], ...] = ()
    wall_s: float = field(default=0.0)
