"""Observation that the landing system gets at a camera frame."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pytest_garl.landing_system import Observation
from pytest_garl.simulation.camera.frame import Frame
from pytest_garl.simulation.physics.vehicle import Quaternion, Vector

Array = TypeVar("Array", bound=np.ndarray[Any, Any])
POSITION_NOISE_M = 0.02
VELOCITY_NOISE_MPS = 0.05
"""Engineering estimate: RTK gives centimetres; 0.05 m/s is u-blox's stated accuracy (M8)."""
_NOT_PAINTED = np.zeros((0, 0, 3), np.uint8)


class LazyObservation(Observation):
    """An observation that notes which of its data is read, and paints its image only then.

    To paint takes longer than all the rest of a frame, and not every system looks at each.  Data
    that a system never reads cannot be a cause of what it does.
    """

    __slots__ = ("_depth_m", "_noted", "_paint", "_rangefinder_m")
    __qualname__ = "Observation"  # It shows itself under the name that users know.
    _paint: Callable[[], NDArray[np.uint8]]
    _depth_m: NDArray[np.float32]
    _rangefinder_m: float | None
    _noted: set[str]

    def __getattr__(self, name: str) -> Any:
        """Say which field was meant; Python calls this for names that are not there."""
        from difflib import get_close_matches

        fields = [each.name for each in dataclasses.fields(Observation)]
        near = get_close_matches(name, fields, n=1)
        hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(fields)}"
        raise AttributeError(f"Observation has no {name!r}; {hint}")

    def __reduce__(self) -> tuple[Callable[[], Observation], tuple[()]]:
        """Copy or pickle it as a plain observation."""
        values = {each.name: getattr(self, each.name) for each in dataclasses.fields(Observation)}
        return functools.partial(Observation, **values), ()

    @property
    def image(self) -> NDArray[np.uint8]:
        """The RGB image, (h, w, 3), read-only."""
        self._noted.add("image")
        return self._paint()

    @image.setter
    def image(self, image: NDArray[np.uint8]) -> None:
        object.__setattr__(self, "_paint", lambda: image)

    @property
    def depth_m(self) -> NDArray[np.float32]:
        """The planar depth, (h, w), in metres, read-only."""
        self._noted.add("depth_m")
        return self._depth_m

    @depth_m.setter
    def depth_m(self, depth_m: NDArray[np.float32]) -> None:
        object.__setattr__(self, "_depth_m", depth_m)

    @property
    def rangefinder_m(self) -> float | None:
        """The reading of the rangefinder."""
        self._noted.add("rangefinder_m")
        return self._rangefinder_m

    @rangefinder_m.setter
    def rangefinder_m(self, rangefinder_m: float | None) -> None:
        object.__setattr__(self, "_rangefinder_m", rangefinder_m)
        # The constructor sets this field last; copying an observation reads all of it.
        object.__setattr__(self, "_noted", set())


def observe(
    frame: Frame,
    *,
    time_s: float,
    position_m: Vector,
    velocity_mps: Vector,
    attitude: Quaternion,
    rangefinder_m: float | None,
    rng: np.random.Generator,
    noted: set[str],
) -> Observation:
    """Return what a frame shows, the pose with noise drawn from ``rng``; arrays are read-only.

    ``noted`` takes the names of the data that the landing system reads: those in ``OBSERVED``.
    """
    noise = rng.standard_normal(6)
    observation = LazyObservation(
        time_s=time_s,
        position_m=_frozen(np.array(position_m) + POSITION_NOISE_M * noise[:3]),
        velocity_mps=_frozen(np.array(velocity_mps) + VELOCITY_NOISE_MPS * noise[3:]),
        attitude=_frozen(np.array(attitude)),
        image=_NOT_PAINTED,
        depth_m=_frozen(frame.measured_depth_m),
        rangefinder_m=rangefinder_m,
    )
    object.__setattr__(observation, "_paint", lambda: _frozen(frame.image))
    object.__setattr__(observation, "_noted", noted)
    return observation


def estimation_error_m(observation: Observation, position_m: Vector) -> Vector:
    """Return the difference between the position that a system gets and the true one."""
    x, y, z = (float(value) for value in observation.position_m - np.array(position_m))
    return x, y, z


def _frozen(array: Array) -> Array:
    array.flags.writeable = False
    # A view of what is read-only cannot be made writeable again, as its owner could.
    return array.view()
