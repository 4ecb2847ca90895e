"""Processor time of the Ego-Planner on one core: per replan, and per observed frame."""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, field

import numpy as np

from landing_systems.modules.planning_ego import LANDING, EgoPlanner
from landing_systems.modules.planning_ego.planner import Setpoint
from pytest_garl import Camera
from tests.landing_systems.box_world import Box, observe

REPLAN_TARGET_MS = 15.0
OBSERVE_TARGET_MS = 4.0
FRAMES = 250


@dataclass(slots=True)
class Times:
    """Seconds of processor time of each replan and of each observed frame."""

    replans: list[float] = field(default_factory=list)
    frames: list[float] = field(default_factory=list)


def random_boxes(rng: np.random.Generator, count: int) -> list[Box]:
    """Return boxes of 1 to 7 m height on a map of 26 m by 26 m."""
    boxes: list[Box] = []
    for _ in range(count):
        (x, y), (width, depth) = rng.uniform(-12, 12, 2), rng.uniform(0.3, 3.0, 2)
        low = (float(x - width / 2), float(y - depth / 2), 0.0)
        boxes.append((low, (low[0] + float(width), low[1] + float(depth), rng.uniform(1, 7))))
    return boxes


def fly(seed: int, times: Times) -> int:
    """Cross a scene at 10 m and come back at 4 m; return the number of frames without a plan."""
    rng = np.random.default_rng(seed)
    boxes = random_boxes(rng, 10)
    camera = Camera()
    planner = EgoPlanner(LANDING, camera)
    position, velocity = np.array([-14.0, float(rng.uniform(-6, 6)), 10.0]), np.zeros(3)
    goals = [(14.0, float(rng.uniform(-6, 6)), 10.0), (14.0, float(rng.uniform(-6, 6)), 4.0)]
    goals.append((-14.0, float(rng.uniform(-6, 6)), 4.0))
    failures = 0
    for frame in range(FRAMES):
        time_s = frame / camera.rate_hz
        observation = observe(camera, time_s, position, boxes, offset_m=LANDING.camera_offset_m)
        began = time.process_time()
        planner.observe(observation)
        times.frames.append(time.process_time() - began)
        planner.set_goal(goals[0])
        before, began = planner.replans, time.process_time()
        setpoint: Setpoint = planner.plan(time_s, position, velocity)
        if planner.replans > before:
            times.replans.append(time.process_time() - began)
        failures += setpoint.error is not None
        if setpoint.reached:
            goals.pop(0)
            if not goals:
                break
        position, velocity = np.array(setpoint.position_m), np.array(setpoint.velocity_mps)
    return failures


def main() -> None:
    """Print median and 95th percentile of the times beside the targets."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=6, help="seeded scenes (default 6)")
    arguments = parser.parse_args()
    times = Times()
    failures = sum(fly(seed, times) for seed in range(arguments.scenes))
    for label, values, target in (
        ("replan", times.replans, REPLAN_TARGET_MS),
        ("observe", times.frames, OBSERVE_TARGET_MS),
    ):
        median, tail = (1000 * float(value) for value in np.percentile(values, [50, 95]))
        print(
            f"{label}: median {median:.1f} ms (target {target:g}), 95th percentile {tail:.1f} ms, "
            f"{len(values)} in all"
        )
    print(f"{failures} frames had no plan")


if __name__ == "__main__":
    main()
