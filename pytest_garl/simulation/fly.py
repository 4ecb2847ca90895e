"""Fly one landing system through one scenario: the simulator's front door."""

from __future__ import annotations

import dataclasses
import functools
import time
from collections.abc import Callable
from typing import Any

from pytest_garl.cpu_dispatch import dispatched
from pytest_garl.engine import packages
from pytest_garl.flight.flight import Flight, version_of
from pytest_garl.flight.flight_file import hash_of
from pytest_garl.scenarios.conditions import active_conditions
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.loop import Loop
from pytest_garl.simulation.nominal import with_nominal_landing
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.simulation.system_under_test.calls import StepGuard


def fly(
    scenario: Scenario,
    system: Callable[[], Any],
    npcs: PolicySpec,
    *,
    map: Map | None = None,
    time_limit_s: float = 120.0,
    guard: StepGuard | None = None,
) -> Flight:
    """Return the record of one flight, a pure function of its arguments.

    ``system`` is the landing system's class, ``npcs`` is the NPC policy.
    Whatever the landing system raises or returns ends in the record, never as an
    exception, its SystemExit included; KeyboardInterrupt passes through.
    """
    began = time.perf_counter()
    placed = Placed(scenario, map or load_map(scenario.map))
    loop = Loop(placed, system, npcs.make, time_limit_s, guard, npcs.event_director())
    flight = dataclasses.replace(
        with_nominal_landing(loop.run(), placed, loop.camera),
        conditions=tuple(each.cause for each in active_conditions(scenario)),
        cpu=dispatched(),
        versions=_versions(packages()),
        wall_s=time.perf_counter() - began,
    )
    return dataclasses.replace(flight, sha256=hash_of(flight))


@functools.cache
def _versions(names: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    return tuple((name, version_of(name)) for name in names)
