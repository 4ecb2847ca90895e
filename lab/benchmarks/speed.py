"""Measures flights against real time, and where their time goes.

``python -m lab.benchmarks.speed`` flies, and for each landing system, with objects that the policy
``dqn-paper`` moves, it prints the shares of its own modules and of the simulator.
"""

from __future__ import annotations

import functools
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
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.physics.bullet_world import BulletWorld
from pytest_garl.simulation.physics.npc import Npc

Parts = tuple[tuple[str, Any, tuple[str, ...]], ...]
"""Name, class or module, and its functions, of each part."""
PARTS: Parts = (
    ("detection, OpenCV", OpenCvDetector, ("detect",)),
    ("detection, TPH-YOLO", TphYoloDetector, ("detect",)),
    ("planning: observe and replan", EgoPlanner, ("observe", "plan")),
    ("watch for movements", MovementWatch, ("points_in_the_way",)),
    ("flight control of MM-MLS", MultiModuleLandingSystem, ("control",)),
    ("camera: depth and segments", Renderer, ("render",)),
    ("camera: images looked at", Renderer, ("_paint",)),
    (
        "physics and contacts",
        BulletWorld,
        ("step", "hull_contacts", "separations", "uav_state", "move"),
    ),
    ("objects and their policy", Npc, ("decide", "advance")),
)
REST = "rest"


class Shares:
    """CPU seconds by part; the time of a nested call of another part counts only for that part."""

    def __init__(self, parts: Parts = PARTS) -> None:
        self._parts = parts
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

    def measure(self, work: Callable[[], Any]) -> Any:
        """Do it, and measure the time of all parts; that takes a twentieth of a flight more."""
        with ExitStack() as patched:
            for part, owner, methods in self._parts:
                for method in methods:
                    call = self.timed(part, getattr(owner, method))
                    patched.enter_context(patch.object(owner, method, call))
            self._since = time.process_time()
            result = work()
            self._switch()
        return result


def shares(count: int = 4) -> None:
    """Print, for each landing system, the time of flights on court and lawn, and its parts."""
    for system in (OpenCvLandingSystem, TphYoloLandingSystem, MultiModuleLandingSystem):
        spent = Shares()
        simulated = 0.0
        for name in ("court", "lawn"):
            map = load_map(name)
            for scenario in random_scenarios(map, genome_for(map), 0, 0, count):
                flown = spent.measure(
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
    shares()


if __name__ == "__main__":
    main()
