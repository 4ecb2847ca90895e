"""What the domain ``field`` costs: milliseconds a frame, and a flight beside one in ``paper``.

``python -m lab.benchmarks.field`` renders frames of random sparse scenarios on both maps, from
views of a landing, and prints the median of the processor time of a frame and where it goes.  Then
it flies OpenCV-MLS in ``field`` and in ``paper`` by turns and prints the ratio of their times.
"""

from __future__ import annotations

import argparse
import functools
import math
import time
from collections.abc import Iterator

import cv2
import numpy as np

from lab.benchmarks.speed import Parts, Shares
from landing_systems.opencv_mls import OpenCvLandingSystem
from pytest_garl.landing_system import Camera
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.simulation.camera import renderer as renderer_module
from pytest_garl.simulation.camera.cover_event import renderer_of
from pytest_garl.simulation.camera.exposure import Exposure, Movement
from pytest_garl.simulation.camera.image_sensor import Sensor
from pytest_garl.simulation.camera.particles import Particles
from pytest_garl.simulation.camera.projection import eye_under
from pytest_garl.simulation.camera.solids import PaintedSolid, Solids
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.landing_moments import LandingMoments

MAPS = ("court", "lawn")
HEIGHTS_M = (10.0, 10.0, 10.0, 8.0, 6.0, 4.0, 2.0, 1.0)
"""A search at 10 m takes about as long as the descent."""
PARTS: Parts = (
    ("depth and segments of solids", Solids, ("draw",)),
    ("ground", renderer_module, ("_ground_image",)),
    ("shadows", renderer_module, ("draw_shadows",)),
    ("colours of solids", PaintedSolid, ("paint_onto",)),
    ("rain, snow, leaves", Particles, ("draw",)),
    ("fog and dust", renderer_module, ("_fog",)),
    ("blur and dirt", Exposure, ("moved", "soiled")),
    ("sensor", Sensor, ("expose",)),
    ("what shows of the marker", renderer_module.Renderer, ("_marker_view",)),
)


def scenarios(domain: str, map_name: str, count: int) -> Iterator[Scenario]:
    """Yield random scenarios of a domain, drawn as a search draws them."""
    map = load_map(map_name)
    genome = genome_of(domain_named(domain), map)
    for number in range(count):
        rng = np.random.default_rng([31, number])
        seed = int(rng.integers(2**32))
        yield repair(decode(genome.random(rng), genome, map=map_name, seed=seed), map)


def frame_ms(scenario: Scenario) -> list[float]:
    """Return the processor time in milliseconds of each frame of a landing's views."""
    map, rng = load_map(scenario.map), np.random.default_rng(scenario.seed)
    placed = Placed(scenario, map)
    made = renderer_of(placed, Camera(), LandingMoments())
    x, y = made.marker_m
    times = []
    for number, height in enumerate(HEIGHTS_M):
        away = height * rng.uniform(-0.4, 0.4, 2)
        roll, pitch = rng.normal(0, math.radians(4) / 2, 2)
        turn = np.array([roll, pitch, math.sin(0.5), math.cos(0.5)])
        qx, qy, qz, qw = (float(each) for each in turn / np.linalg.norm(turn))
        attitude = (qx, qy, qz, qw)
        eye = eye_under((x + float(away[0]), y + float(away[1]), height), attitude)
        bodies = [
            ((x + float(dx), y + float(dy), 0.0), float(yaw))
            for dx, dy, yaw in rng.uniform(-5, 5, (len(placed.map.present_objects), 3))
        ]
        movement = Movement(velocity_mps=(1.0, 0.5, -0.5), spin_radps=(0.05, 0.05, 0.0))
        began = time.process_time()
        frame = made.render(eye, attitude, number * 1.7, bodies, movement)
        frame.image, frame.marker  # noqa: B018 (both are made on access)
        times.append(1000 * (time.process_time() - began))
    return times[1:]  # the first one fills caches


def frames(count: int) -> None:
    """Print the time of a frame on each map, and its parts."""
    for map_name in MAPS:
        drawn = list(scenarios("field", map_name, count))
        plain = [frame_ms(each) for each in drawn]
        falling = [
            times
            for each, times in zip(drawn, plain, strict=True)
            if max(each["environment.fog"], each["environment.rain"]) > 0
        ]
        every = np.concatenate(plain)
        text = f"{map_name}: {len(every)} frames, median {np.median(every):.2f} ms, "
        text += f"90 % below {np.quantile(every, 0.9):.2f} ms"
        if falling:
            text += f"; with fog or rain {np.median(np.concatenate(falling)):.2f} ms"
        print(text)
        spent = Shares(PARTS)
        for each in drawn:
            spent.measure(functools.partial(frame_ms, each))
        total_s = sum(spent.seconds.values())
        for part, seconds in sorted(spent.seconds.items(), key=lambda item: -item[1]):
            print(f"  {100 * seconds / total_s:4.0f} % {part}")


def flights(count: int) -> None:
    """Print how much more a flight in ``field`` costs than one in ``paper``, on each map."""
    for map_name in MAPS:
        spent, flown = (
            dict.fromkeys(("field", "paper"), 0.0),
            dict.fromkeys(("field", "paper"), 0.0),
        )
        pairs = zip(
            scenarios("field", map_name, count), scenarios("paper", map_name, count), strict=True
        )
        for pair in pairs:
            for domain, scenario in zip(("field", "paper"), pair, strict=True):
                policy = policy_spec("waypoint")
                began = time.process_time()
                flight = fly(scenario, OpenCvLandingSystem, policy, map=load_map(map_name))
                spent[domain] += time.process_time() - began
                flown[domain] += flight.elapsed_s
        a_flight = spent["field"] / spent["paper"]
        a_second = a_flight * flown["paper"] / flown["field"]
        print(
            f"{map_name}: {count} flights in field cost {a_flight:.2f} times those in paper, "
            f"{a_second:.2f} times per flown second"
        )


def main(count: int = 20) -> None:
    """Print frames and flights."""
    cv2.setNumThreads(1)
    frames(3 * count)
    flights(count)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenarios", type=int, nargs="?", default=20)
    main(parser.parse_args().scenarios)
