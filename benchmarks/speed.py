"""Milliseconds per frame, flights against real time, and where a flight's time goes."""

from __future__ import annotations

import statistics
import time

import cv2

from landing_systems.opencv_mls import OpenCvLandingSystem
from pytest_garl.adversary.policies import policy_spec
from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps import load_map
from pytest_garl.search.random_search import propose
from pytest_garl.simulation.camera import Renderer
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.randomness import generator


def frames() -> None:
    """Print the median time of a frame, clear and with all weather, at both sizes."""
    map = load_map("lawn")
    scenario = propose(map, genome_for(map), 0, 0, 1)[0]
    weather = [key for key, _ in scenario.genes if key.startswith("environment.")][:-1]
    for label, value in (("clear", 0.0), ("all genes 0.15", 0.15), ("all genes 1", 1.0)):
        case = scenario.replace({**dict.fromkeys(weather, value), "environment.sun_position": 0.4})
        for width, height in ((320, 240), (640, 480)):
            camera = Camera(width_px=width, height_px=height)
            renderer = Renderer(case, map, camera, generator(0, "sensor"))
            x, y = renderer.marker_m
            objects = [((x + 1.0 + i, y + 1.0, 0.0), 0.3) for i in range(len(map.object_names))]
            for up in (10.0, 2.0):
                times = []
                for index in range(60):
                    began = time.perf_counter()
                    renderer.render((x, y, up), (0, 0, 0, 1), index / 10, objects)
                    times.append(time.perf_counter() - began)
                milliseconds = 1000 * statistics.median(times)
                print(f"{label:15} {width}x{height} from {up:4.0f} m: {milliseconds:5.2f} ms")


def flights() -> None:
    """Print how much faster than real time OpenCV-MLS flies on one core."""
    for name in ("court", "lawn"):
        map = load_map(name)
        simulated = wall = 0.0
        for scenario in propose(map, genome_for(map), 0, 0, 6):
            began = time.perf_counter()
            flight = fly(scenario, OpenCvLandingSystem, policy_spec("waypoint"), map=map)
            wall += time.perf_counter() - began
            simulated += flight.elapsed_s
        print(
            f"OpenCV-MLS on {name}: {simulated / wall:.1f} times real time, {wall / 6:.1f} s each"
        )


def main() -> None:
    """Measure on one core."""
    cv2.setNumThreads(1)
    frames()
    flights()


if __name__ == "__main__":
    main()
