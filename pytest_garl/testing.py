"""A public checker: what a user runs on a landing system before anything else."""

from __future__ import annotations

import inspect
from typing import Any

from pytest_garl.adversary.policies import policy_spec
from pytest_garl.errors import LandingSystemError
from pytest_garl.landing_system import Airframe, Mission, Observation, airframe_of
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps import load_map
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.reference import check_system
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.record import parted_s


def check_landing_system(system: type, *, seconds: float = 5.0, map: str = "lawn") -> None:
    """Fly a class for a few seconds and raise LandingSystemError that names what is wrong.

    Checks that it has the contract's methods and can be imported by a child process, that
    its airframe is one, that it returns commands, leaves its observations alone, decides
    the same in the same flight, and that ``reset`` forgets the flight before.
    """
    check_system(system)
    _check_airframe(system)
    _check_signature(system, "reset", 1)
    _check_signature(system, "step", 1)
    first, again = (_fly(system, seconds, map) for _ in range(2))
    _compare(system, first, again, "two flights of the same scenario part")
    kept: Any = _keep_one(system)
    _fly(kept, seconds, map)
    _compare(
        system,
        first,
        _fly(kept, seconds, map),
        "a second flight of one instance differs; reset(mission) must forget the flight before",
    )


def _check_airframe(system: type) -> None:
    airframe = getattr(system, "airframe", None)
    if airframe is not None and not isinstance(airframe, Airframe):
        raise LandingSystemError(
            f"{system.__name__}.airframe is {airframe!r}; expected pytest_garl.Airframe(...)"
        )
    flies = callable(getattr(system, "control", None))
    if flies != (airframe_of(system).control_rate_hz is not None):
        raise LandingSystemError(
            f"{system.__name__}: a method control(state) and Airframe(control_rate_hz=...) belong "
            "together; found only one of them"
        )


def _check_signature(system: type, method: str, count: int) -> None:
    try:
        inspect.signature(getattr(system, method)).bind(*[None] * (count + 1))
    except TypeError as error:
        raise LandingSystemError(
            f"{system.__name__}.{method}: {error}; expected one argument beside self"
        ) from error


def _fly(system: Any, seconds: float, name: str) -> Any:
    place = load_map(name)
    genome = genome_for(place)
    scenario = repair(decode(genome.nominal, genome, map=name, seed=1), place)
    flight = fly(scenario, system, policy_spec("waypoint"), map=place, time_limit_s=seconds)
    if flight.crash is not None:
        crash = flight.crash
        hint = ""
        if "read-only" in crash.message:
            hint = "; observations are read-only, copy the array before changing it"
        raise LandingSystemError(
            f"{crash.where}: {crash.error}: {crash.message}{hint}\n{crash.traceback}".rstrip()
        )
    return flight


def _compare(system: type, first: Any, again: Any, problem: str) -> None:
    if first.sha256 == again.sha256:
        return
    parted = parted_s(first, again)
    raise LandingSystemError(f"{system.__name__}: {problem}, first at {parted:.2f} s")


def _keep_one(system: type) -> Any:
    """Return a stand-in for the class that hands out one and the same instance."""
    instance = system()

    class Kept:
        airframe = airframe_of(system)
        needs_camera = getattr(system, "needs_camera", True)

        def reset(self, mission: Mission) -> None:
            instance.reset(mission)

        def step(self, observation: Observation) -> Any:
            return instance.step(observation)

        def control(self, state: Any) -> Any:
            return instance.control(state)

    Kept.__name__ = system.__name__
    return Kept
