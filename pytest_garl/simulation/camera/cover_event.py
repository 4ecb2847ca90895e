"""Something that lies over a part of the marker for some seconds."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.camera.exposure import STILL, Movement
from pytest_garl.simulation.camera.frame import Frame
from pytest_garl.simulation.camera.renderer import Quaternion, Renderer, Vector
from pytest_garl.simulation.camera.solids import BodyPose
from pytest_garl.simulation.events import Event, Moments
from pytest_garl.simulation.randomness import generator


def renderer_of(
    placed: Placed, camera: Camera, moments: Moments, *, colour: bool = True
) -> Renderer:
    """Return the renderer of a flight's frames, with what covers the marker for a while."""
    scenario = placed.scenario
    rng = generator(scenario.seed, "sensor")
    if not _is_covered(scenario):
        return Renderer(placed, camera, rng, colour=colour)
    return _Covering(placed, camera, rng, moments, colour=colour)


def _is_covered(scenario: Scenario) -> bool:
    return min(scenario["cover.lasts_s"], scenario["cover.share_percent"]) > 0


class _Covering(Renderer):
    """Draws with the cover while it lies there, and without it before and after."""

    def __init__(
        self,
        placed: Placed,
        camera: Camera,
        rng: np.random.Generator,
        moments: Moments,
        *,
        colour: bool = True,
    ) -> None:
        super().__init__(placed, camera, rng, colour=colour)
        scenario = placed.scenario
        self._event = Event(scenario, "cover", moments)
        share = scenario["cover.share_percent"] / 100
        self._with_cover = self.with_pad(dataclasses.replace(placed.pad, covered_share=share))

    def change(self, scenario: Scenario) -> None:
        """Show the environment of ``scenario`` from the next frame on."""
        super().change(scenario)
        self._with_cover.change(scenario)

    def render(
        self,
        position_m: Vector,
        attitude: Quaternion,
        time_s: float,
        objects: Sequence[BodyPose],
        movement: Movement = STILL,
    ) -> Frame:
        """Return the frame from a camera at ``position_m`` with the UAV's ``attitude``."""
        if self._event.happens(time_s):
            return self._with_cover.render(position_m, attitude, time_s, objects, movement)
        return super().render(position_m, attitude, time_s, objects, movement)
