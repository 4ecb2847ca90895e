"""Measures time per frame, flights against real time, and the time of each part of a flight.

``python -m lab.benchmarks.speed shares`` prints only the parts: for each landing system, with
objects that the policy ``dqn-paper`` moves, the shares of its own modules and of the simulator.
"""

from __future__ import annotations

import functools
import statistics
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any
from unittest.mock import patch

import cv2

from landing_systems.mm_mls import MultiModuleLandingSystem
from landing_systems.modules.detection_opencv import OpenCvDetector
from landing_systems.modules.detection_tphyolo.detector import TphYoloDetector
from landing_systems.modules.movement_watch import MovementWatch
from landing_systems.modules.planning_ego import EgoPlanner
from landing_systems.opencv_mls import OpenCvLandingSystem
from landing_systems.tphyolo_mls import TphYoloLandingSystem
from pytest_garl.landing_system import Camera
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.physics.npc import Npc
from pytest_garl.simulation.physics.world import World
from pytest_garl.simulation.randomness import generator

PARTS: tuple[tuple[str, Any, tuple[str, ...]], ...] = (
    ("detection, OpenCV", OpenCvDetector, ("detect",)),
    ("detection, TPH-YOLO", TphYoloDetector, ("detect",)),
    ("planning: observe and replan", EgoPlanner, ("observe", "plan")),
    ("watch for movements", MovementWatch, ("points_in_the_way",)),
    ("flight control of MM-MLS", MultiModuleLandingSystem, ("control",)),
    ("camera: depth and segments", Renderer, ("render",)),
    ("camera: images looked at", Renderer, ("_paint",)),
    ("physics and contacts", World, ("step", "touches", "separations", "uav", "move")),
    ("objects and their policy", Npc, ("decide", "advance")),
)
REST = "rest of the flight"


def frames() -> None:
    """Print the median time of a frame, clear and with all weather, at both sizes."""
    map = load_map("lawn")
    scenario = random_scenarios(map, genome_for(map), 0, 0, 1)[0]
    weather = [key for key, _ in scenario.genes if key.startswith("environment.")][:-1]
    for label, value in (("clear", 0.0), ("all genes 0.15", 0.15), ("all genes 1", 1.0)):
        case = scenario.replace({**dict.fromkeys(weather, value), "environment.sun_position": 0.4})
        for width, height in ((320, 240), (640, 480)):
            camera = Camera(width_px=width, height_px=height)
            renderer = Renderer(Placed(case, map), camera, generator(0, "sensor"))
            x, y = renderer.marker_m
            objects = [((x + 1.0 + i, y + 1.0, 0.0), 0.3) for i in range(len(map.present_objects))]
            for height_m in (10.0, 2.0):
                times = []
                for index in range(60):
                    began = time.perf_counter()
                    renderer.render((x, y, height_m), (0, 0, 0, 1), index / 10, objects)
                    times.append(time.perf_counter() - began)
                milliseconds = 1000 * statistics.median(times)
                print(f"{label:15} {width}x{height} from {height_m:4.0f} m: {milliseconds:5.2f} ms")


def flights() -> None:
    """Print how much faster than real time OpenCV-MLS flies on one core."""
    for name in ("court", "lawn"):
        map = load_map(name)
        simulated = wall = 0.0
        for scenario in random_scenarios(map, genome_for(map), 0, 0, 6):
            began = time.perf_counter()
            flight = fly(scenario, OpenCvLandingSystem, policy_spec("waypoint"), map=map)
            wall += time.perf_counter() - began
            simulated += flight.elapsed_s
        print(
            f"OpenCV-MLS on {name}: {simulated / wall:.1f} times real time, {wall / 6:.1f} s each"
        )


class Shares:
    """CPU seconds by part; the time of a nested call of another part counts only for that part."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = defaultdict(float)
        self._active_parts: list[str] = [REST]
        self._since = time.process_time()

    def _switch(self) -> None:
        """Add the time since the last switch to the part that is active now."""
        now = time.process_time()
        self.seconds[self._active_parts[-1]] += now - self._since
        self._since = now

    def timed(self, part: str, call: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function that calls ``call`` and adds its time to ``part``."""

        @functools.wraps(call)
        def wrapped(*args: Any, **kwargs: Any) -> Any:
            self._switch()
            self._active_parts.append(part)
            try:
                return call(*args, **kwargs)
            finally:
                self._switch()
                self._active_parts.pop()

        return wrapped

    def fly(self, flight: Callable[[], Any]) -> Any:
        """Fly, and measure the time of all parts; measuring takes about a twentieth of it."""
        with ExitStack() as patched:
            for part, owner, methods in PARTS:
                for method in methods:
                    call = self.timed(part, getattr(owner, method))
                    patched.enter_context(patch.object(owner, method, call))
            self._since = time.process_time()
            result = flight()
            self._switch()
        return result


def shares(count: int = 4) -> None:
    """Print, for each landing system, where the time of flights on court and lawn goes."""
    for system in (OpenCvLandingSystem, TphYoloLandingSystem, MultiModuleLandingSystem):
        spent = Shares()
        simulated = 0.0
        for name in ("court", "lawn"):
            map = load_map(name)
            for scenario in random_scenarios(map, genome_for(map), 0, 0, count):
                flown = spent.fly(
                    functools.partial(fly, scenario, system, policy_spec("dqn-paper"), map=map)
                )
                simulated += flown.elapsed_s
        total = sum(spent.seconds.values())
        print(
            f"{system.__name__}: {total / (2 * count):.1f} CPU seconds a flight of "
            f"{simulated / (2 * count):.0f} s ({simulated / total:.1f} times real time)"
        )
        for part, seconds in sorted(spent.seconds.items(), key=lambda item: -item[1]):
            print(f"  {100 * seconds / total:5.1f} %  {part}")


def main() -> None:
    """Measure on one core."""
    cv2.setNumThreads(1)
    if sys.argv[1:] == ["shares"]:
        shares()
        return
    frames()
    flights()
    shares()


if __name__ == "__main__":
    main()
