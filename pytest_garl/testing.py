"""A public checker of landing systems: users run it before their first search."""

from __future__ import annotations

import contextlib
import dataclasses
import inspect
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from pytest_garl import cpu_dispatch
from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.errors import LandingSystemError
from pytest_garl.execution.metering import CallMeter, OutOfTimeError
from pytest_garl.execution.reference import check_system
from pytest_garl.execution.separate_process import call_in_separate_process
from pytest_garl.landing_system import Mission, Observation, airframe_of
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.map import Map, load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.flight import Flight
from pytest_garl.simulation.flight_file import divergence_time_s
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.sightings import reports_detections, reports_targets
from pytest_garl.verdicts.verdict import PAPER_LIMITS, Limits

FLIGHTS = 40
"""Flights of the search whose time the check estimates: the README's first budget."""
SLOW_FLIGHT_S = 10.0
"""Computing time of one flight above which the check warns: a night has some 3,000 such flights."""
SLOW_CALL_S = 3.0
"""Computing time of one call above which the check warns: a search ends calls of 10 s by default,
and a loaded machine may be three times as slow."""
SHORTEST_S = 2.0
"""Simulated time of the shortest flights that are still compared."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """The result of a check: how the flights ended, warnings, and the cost of a flight.

    ``flights`` and ``warnings`` are sentences; ``cpu_s`` is the computing time of one flight in
    seconds, the simulator's included.
    """

    system: str
    flights: tuple[str, ...]
    warnings: tuple[str, ...]
    cpu_s: float

    def __str__(self) -> str:
        cost = (
            f"a flight takes {self.cpu_s:.1f} s of computing: {FLIGHTS} flights take about "
            f"{FLIGHTS * self.cpu_s:.0f} s, divided by the number of workers"
        )
        warned = [f"warning: {text}" for text in self.warnings]
        return "\n".join([f"{self.system}: {text}" for text in (*self.flights, cost)] + warned)


def check_landing_system(
    system: type,
    *,
    seconds: float | None = None,
    map: str = "lawn",
    deterministic: bool = True,
    limit_s: float = 120.0,
) -> Check:
    """Fly a class in two scenarios and return the result; raise LandingSystemError for a fault.

    Checks that the class has the contract's methods and can be imported by a worker process, that
    its airframe is valid, that it returns commands, leaves its observations unchanged, decides the
    same in the same flight, and that ``reset`` forgets the flight before: one instance flies the
    first scenario, the second and the first again, and each flight is compared with that of a fresh
    instance.

    ``seconds`` ends each flight early (simulated time; by default it flies until it landed, or
    120 s).  ``deterministic=False`` turns a difference between equal flights into a warning.
    ``limit_s`` is the computing time (CPU) for all flights; a slow system is compared over shorter
    ones.  A call that takes 30 s counts as hanging.  If NumPy was loaded earlier and computes with
    other instructions than a search, the check runs in a separate process.
    """
    check_system(system)
    _check_airframe(system)
    _check_signature(system, "reset", 1)
    _check_signature(system, "step", 1)
    if not cpu_dispatch.pin():
        # NumPy was loaded earlier, and computes with other instructions than a search.
        options = {
            "seconds": seconds,
            "map": map,
            "deterministic": deterministic,
            "limit_s": limit_s,
        }
        values = call_in_separate_process("pytest_garl.testing:_check_as_values", system, options)
        lists = {"flights": (*values["flights"],), "warnings": (*values["warnings"],)}
        return Check(**{**values, **lists})
    return _Checker(system, map, seconds, deterministic, limit_s).run()


def _check_as_values(system: type, **options: Any) -> dict[str, Any]:
    return dataclasses.asdict(check_landing_system(system, **options))


class _TimedFlight(NamedTuple):
    flight: Flight
    cpu_s: float


class _Checker:
    """Flies one class in a calm scenario and in a drawn one, both without moving objects."""

    def __init__(
        self, system: type, map: str, seconds: float | None, deterministic: bool, limit_s: float
    ) -> None:
        self._system, self._deterministic = system, deterministic
        self._seconds = seconds or PAPER_LIMITS.time_s
        self._whole = seconds is None or seconds >= PAPER_LIMITS.time_s
        self._map = load_map(map, (Path.cwd() / "scenarios" / "maps",))
        self._calm, self._drawn = _scenarios(self._map)
        self._meter = CallMeter(limit_s)
        self._limit_s = limit_s
        self._warnings: list[str] = []

    def run(self) -> Check:
        """Fly the scenarios and compare the flights."""
        flights: list[str] = []
        cpu_s = self._limit_s
        with _warning_of_leftovers(self._warnings.append):
            try:
                first = self._fly(self._system, self._calm, self._seconds)
                flights.append(f"{self._map.name}: {_ending(first.flight)}")
                cpu_s = first.cpu_s
                self._warn_of_flight(first)
                other = self._compare(first)
                flights.append(f"{self._map.name}, another scenario: {_ending(other.flight)}")
                if {first.flight.outcome, other.flight.outcome} == {"gave_up"}:
                    self._warnings.append("gave up in both scenarios; a search would learn nothing")
            except OutOfTimeError:
                self._warnings.append(
                    f"stopped after {self._limit_s:g} s of computing; not all flights were flown"
                )
        if self._meter.slowest_s > SLOW_CALL_S:
            self._warnings.append(
                f"one call took {self._meter.slowest_s:.1f} s of computing; a search ends a call "
                "of 10 s (--garl-timeout)"
            )
        return Check(
            system=self._system.__name__,
            flights=tuple(flights),
            warnings=tuple(self._warnings),
            cpu_s=cpu_s,
        )

    def _compare(self, first: _TimedFlight) -> _TimedFlight:
        """Fly both scenarios with fresh instances and with one that flies them all."""
        seconds = self._seconds
        if 5 * first.cpu_s > self._limit_s:
            share = (self._limit_s - first.cpu_s) / (6 * first.cpu_s)
            seconds = max(SHORTEST_S, share * first.flight.elapsed_s)
            first = self._fly(self._system, self._calm, seconds)
        other = self._fly(self._system, self._drawn, seconds)
        reused = _reusing_one_instance(self._system)
        for fresh, scenario, problem in (
            (first, self._calm, "two flights of the same scenario differ"),
            (other, self._drawn, _REMEMBERS),
            (first, self._calm, _REMEMBERS),
        ):
            again = self._fly(reused, scenario, seconds)
            self._check_equal(fresh.flight, again.flight, problem)
        reused.close_instance()
        return other

    def _check_equal(self, fresh: Flight, again: Flight, problem: str) -> None:
        if fresh.sha256 == again.sha256:
            return
        text = (
            f"{self._system.__name__}: {problem}, first at {divergence_time_s(fresh, again):.2f} s"
        )
        if self._deterministic:
            raise LandingSystemError(
                f"{text}; if that is intended, pass deterministic=False here and in the marker"
            )
        if text not in self._warnings:
            self._warnings.append(text)

    def _warn_of_flight(self, first: _TimedFlight) -> None:
        """Warn of problems that a search would have."""
        flight, warn = first.flight, self._warnings.append
        limits = Limits()
        if flight.outcome == "not_landed" and self._whole:
            warn(f"did not land within {self._seconds:.0f} s, in a calm scenario without objects")
        if flight.outcome == "gave_up":
            warn("gave up in a calm scenario without objects")
        if flight.outcome == "collision":
            warn("collided in a calm scenario without moving objects")
        touchdown = flight.touchdown
        if flight.outcome == "landed" and touchdown and touchdown.distance_m > limits.distance_m:
            warn(
                f"landed {touchdown.distance_m:.1f} m off in a calm scenario; the limit is "
                f"{limits.distance_m:g} m"
            )
        if flight.outcome == "slid":
            warn("slid over the ground after its touchdown in a calm scenario")
        if touchdown and touchdown.stopped_s is None and flight.outcome == "not_landed":
            warn(
                "touched the ground, but its motors did not stop; that takes Land(), or a thrust "
                "below 30 % of that of a hover for 1 s"
            )
        if not any(step.diagnostics for step in flight.steps):
            warn(
                "returns no diagnostics: reports cannot say what it saw or intended to do. Return "
                "with each command diagnostics=Diagnostics(target_m=(x, y, 0.0), detections=..., "
                "phase=...): the place that it takes for the marker, the markers that it sees in "
                "the frame, what it does"
            )
        elif self._whole and not (reports_detections(flight) or reports_targets(flight)):
            warn(
                "its diagnostics never name a detection (Diagnostics.detections) or a target "
                "(Diagnostics.target_m)"
            )
        if first.cpu_s > SLOW_FLIGHT_S:
            warn(
                f"slow: {first.cpu_s:.0f} s of computing for {flight.elapsed_s:.0f} s of flight, "
                f"{self._meter.mean_s * 1e3:.0f} ms in each call"
            )

    def _fly(self, system: Any, scenario: Scenario, seconds: float) -> _TimedFlight:
        began = time.process_time()
        with self._meter.timed():
            flight = fly(
                scenario,
                system,
                policy_spec("stationary"),
                map=self._map,
                time_limit_s=seconds,
                guard=self._meter,
            )
        if flight.crash is not None:
            crash, hint = flight.crash, ""
            if "read-only" in crash.message:
                hint = "; observations are read-only, copy the array before changing it"
            raise LandingSystemError(
                f"{crash.where}: {crash.error}: {crash.message}{hint}\n{crash.traceback}".rstrip()
            )
        return _TimedFlight(flight, time.process_time() - began)


_REMEMBERS = (
    "a later flight of one instance differs from the first of a fresh one; reset(mission) must "
    "forget the flight before"
)


def _scenarios(map: Map) -> tuple[Scenario, Scenario]:
    """Return the map's nominal scenario and one that a search might draw, without objects."""
    genome = genome_for(map)
    names = [name for name, _ in map.present_objects]
    calm = repair(decode(genome.nominal, genome, map=map.name, seed=1), map)
    drawn = random_scenarios(map, genome, 1, 0, 1)[0]
    return calm.without(*names), drawn.without(*names)


def _ending(flight: Flight) -> str:
    touchdown = flight.touchdown
    if flight.outcome == "landed" and touchdown:
        return f"landed {touchdown.distance_m:.2f} m off after {touchdown.time_s:.0f} s"
    return judge(flight, Limits()).story


def _check_airframe(system: type) -> None:
    controls_motors = callable(getattr(system, "control", None))
    if controls_motors != (airframe_of(system).control_rate_hz is not None):
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


@contextlib.contextmanager
def _warning_of_leftovers(warn: Callable[[str], None]) -> Iterator[None]:
    """Warn of threads and processes that a landing system leaves running."""
    threads, processes = set(threading.enumerate()), _children()
    yield
    left = [item for item in threading.enumerate() if item not in threads and item.is_alive()]
    if left:
        warn(f"leaves {len(left)} threads running ({left[0].name})")
    started = _children() - processes
    if started:
        warn(f"leaves {len(started)} processes running; a search ends them after each flight")


def _children() -> set[str]:
    files = Path("/proc/self/task").glob("*/children")
    return {pid for file in files for pid in file.read_text().split()}


def _reusing_one_instance(system: type) -> Any:
    """Return a stand-in for the class that always gives the same instance."""
    instances: list[Any] = []

    class Reused:
        airframe = airframe_of(system)

        def __init__(self) -> None:
            if not instances:
                instances.append(system())
            self._instance = instances[0]

        def __getattr__(self, name: str) -> Any:
            return getattr(self._instance, name)

        def reset(self, mission: Mission) -> None:
            self._instance.reset(mission)

        def step(self, observation: Observation) -> Any:
            return self._instance.step(observation)

        def close(self) -> None:
            """Leave the instance open for its next flight."""

        @staticmethod
        def close_instance() -> None:
            """Close the instance after its last flight."""
            for instance in instances:
                getattr(instance, "close", lambda: None)()

    Reused.__name__ = system.__name__
    return Reused
