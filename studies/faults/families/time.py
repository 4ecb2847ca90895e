"""Faults of time: old pictures, old poses, counted frames."""

from __future__ import annotations

import dataclasses
from collections import deque

from pytest_garl import Command, Detection, Mission, Observation
from studies.faults.control import ControlSystem, Vector
from studies.faults.eyes import Eyes
from studies.faults.track import Place


class FrozenEyes(Eyes):
    """Eyes that take a repeated picture for a new one."""

    def is_repeated(self, observation: Observation) -> bool:
        """Believe each picture."""
        return False


class Frozen(ControlSystem):
    """Takes the last picture for a new one if the camera's driver repeats it.

    The report: the camera gets stuck and sends the same frame again and again.
    """

    eyes_of = FrozenEyes


class LateEyes(Eyes):
    """Eyes that combine the picture with the pose of a later frame."""

    FRAMES = 7

    def __init__(self, mission: Mission) -> None:
        super().__init__(mission)
        self._queue: deque[Observation] = deque(maxlen=self.FRAMES + 1)

    def detect(self, observation: Observation) -> tuple[Detection, ...]:
        """Place what the picture of 0.7 s ago shows by the pose of this moment."""
        self._queue.append(observation)
        return super().detect(dataclasses.replace(observation, image=self._queue[0].image))


class Late(ControlSystem):
    """Applies the newest attitude and position to a picture that took 0.7 s to process.

    The report: the stamp of the landing target is ignored, so that the correction belongs to
    another moment.
    """

    eyes_of = LateEyes


class Unfresh(ControlSystem):
    """Descends on the last sighting, however old it is.

    The report: the autopilot believes that it still has the target for seconds after the last
    measurement.
    """

    def land(self, now: float, at: Vector, target: Place) -> Command:
        """Land as if the pad had just been seen."""
        self.track.seen_s = now
        return super().land(now, at, target)
