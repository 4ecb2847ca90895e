"""A public checker of landing systems: users run it before their first search."""

from __future__ import annotations

import contextlib
import dataclasses
import inspect
import math
import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from pytest_garl import cpu_dispatch
from pytest_garl.companion.companion_program import CompanionProgram
from pytest_garl.errors import LandingSystemError
from pytest_garl.execution.exit_guard import refusing_end
from pytest_garl.execution.fly_and_judge import time_limit_s
from pytest_garl.execution.judge_process import JudgeProcess
from pytest_garl.execution.metering import CallMeter, OutOfTimeError
from pytest_garl.execution.reference import check_system
from pytest_garl.execution.result import FlightResult
from pytest_garl.execution.separate_process import call_in_separate_process
from pytest_garl.fiducial import MarkerSpec
from pytest_garl.files.json_values import dataclass_from
from pytest_garl.files.run_files import RUN_FOLDER
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import divergence_time_s
from pytest_garl.foreign_text import shown_foreign
from pytest_garl.landing_system import (
    Mission,
    Observation,
    PositionSetpoint,
    VelocitySetpoint,
    airframe_of,
)
from pytest_garl.messages import shortened
from pytest_garl.npcs.domain_policy import domain_with_policy
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.process_tree import descendants_of
from pytest_garl.program import AnySystem, ProgramOutput, ProgramSystem
from pytest_garl.scenarios.domains.domain import Domain
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.domains.names import DEFAULT_DOMAIN
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.task import Start, Task
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.search.probes import (
    Probe,
    clear_scenario,
    probes_for,
    start_beside,
    without_objects,
)
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test.ground_truth import PilotWrapper, is_own
from pytest_garl.simulation.system_under_test.reading import finite
from pytest_garl.verdicts.clear_air import NEVER_OFF, place_beside_marker, seen_text, why_no_landing
from pytest_garl.verdicts.evidence import Evidence
from pytest_garl.verdicts.verdict import Limits, default_distance_m

FLIGHTS = 40
"""Flights of the search whose time the check estimates: the README's first budget."""
LARGEST_YAW_RAD = 2 * math.pi
"""A heading beyond a full turn is taken for degrees."""
WHERE_TO_FLY = (
    "A program is told about where the marker is by {north_m} {east_m} or {lat_deg} {lon_deg} in "
    "the line that starts it."
)
TAKES_OVER = 'If the program takes over in the air, armed, state start="hover" in pytest.mark.garl.'
SLOW_FLIGHT_S = 10.0
"""Computing time of one flight above which the check warns: a night has some 3,000 such flights."""
SLOW_CALL_S = 3.0
"""Computing time of one call above which the check warns: a search ends calls of 10 s by default,
and a loaded machine may be three times as slow."""
SHORTEST_S = 2.0
"""Simulated time of the shortest flights that are still compared."""
LAST_LINES, LINE_CHARS = 8, 200
"""How much of what a program printed an error shows."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class ProbeResult:
    """How a probe ended: a flight with one cause (``docs/probes.md``).

    ``sentence`` says what was not as in clear air, ``ending`` how the flight ended, ``outside``
    which of its values the domain does not have, so that a violation is only a note.
    """

    name: str
    sentence: str
    ending: str
    violated: bool
    outside: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether it violates nothing that may be asked in the domain."""
        return not self.violated or bool(self.outside)

    def __str__(self) -> str:
        verdict = "ok" if not self.violated else "note" if self.outside else "FAILED"
        note = f" (outside the domain: {self.outside[0]})" if verdict == "note" else ""
        return f"probe {self.name}: {verdict}: {self.sentence}: {self.ending}{note}"


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """The result of a check: how the flights ended, faults, warnings, and the cost of a flight.

    ``flights``, ``faults`` and ``warnings`` are sentences; a search would meet a fault in every
    flight.  ``cpu_s`` is the computing time of one flight in seconds, the simulator's included, and
    ``longest_cpu_s`` that of one which lasts ``longest_s``, the most that the limits allow.
    """

    system: str
    flights: tuple[str, ...]
    warnings: tuple[str, ...]
    cpu_s: float
    task: str = ""
    """The map, the marker that lies there, and the system's camera, in a line."""
    longest_s: float = 0.0
    longest_cpu_s: float = 0.0
    faults: tuple[str, ...] = ()
    probes: tuple[ProbeResult, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether there is no fault, and no probe violates."""
        return not self.faults and all(probe.passed for probe in self.probes)

    def __str__(self) -> str:
        found = [f"fault: {text}" for text in self.faults]
        found += [f"warning: {text}" for text in self.warnings]
        fine = [probe.name for probe in self.probes if not probe.violated]
        lines = [self.task, *self.flights, "" if self.faults else self._cost_text()]
        lines += [f"probes {', '.join(fine)}: ok"] if fine else []
        lines += [str(probe) for probe in self.probes if probe.violated]
        return "\n".join([f"{self.system}: {text}" for text in lines if text] + found)

    def _cost_text(self) -> str:
        """Return what a search costs, by the cheapest flights and by the longest ones."""
        low_s = FLIGHTS * self.cpu_s
        high_s = FLIGHTS * max(self.cpu_s, self.longest_cpu_s)
        return (
            f"a search of {FLIGHTS} flights on a map takes {low_s:.0f} to {high_s:.0f} s of "
            "computing, which workers share, and about as much again to shrink what fails"
        )


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class CheckPlan:
    """What a check flies: one map with the task, the domain and the limits of a test.

    ``seconds`` ends each flight early; None flies until it landed, or for the limit of time.
    ``limit_s`` is the computing time (CPU) for all flights, and that for all ``probes``.
    """

    map: Map
    task: Task
    domain: Domain
    limits: Limits
    seconds: float | None = None
    deterministic: bool = True
    limit_s: float = 120.0
    probes: bool = False


def check_landing_system(
    system: AnySystem,
    *,
    seconds: float | None = None,
    map: str = "lawn",
    deterministic: bool = True,
    limit_s: float = 120.0,
    marker: MarkerSpec | None = None,
    start: Start | None = None,
    domain: str = DEFAULT_DOMAIN,
    limits: Limits | None = None,
    probes: bool = False,
) -> Check:
    """Fly a class or a program in two scenarios; raise LandingSystemError for a fault.

    Checks that the class has the contract's methods and can be imported by a worker process, that
    its airframe is valid, that it returns commands, leaves its observations unchanged, decides the
    same in the same flight, and that ``reset`` forgets the flight before: one instance flies the
    first scenario, the second and the first again, and each flight is compared with that of a fresh
    instance.

    ``marker``, ``start``, ``domain`` (a name, or a TOML file) and ``limits`` are those of a test;
    without a marker the map's lies there.  The first scenario is the mildest one of the domain.
    ``seconds`` ends each flight early (simulated time; by default it flies until it landed, or
    120 s).  ``deterministic=False`` turns a difference between equal flights into a warning.
    ``limit_s`` is the computing time (CPU) for all flights; a slow system is compared over shorter
    ones.  With ``probes`` a landing system that lands in clear air also flies the probes: scenarios
    with one cause each, which have as much time.  A call that takes 30 s counts as hanging.  If
    NumPy was loaded earlier and computes with other instructions than a search, the check runs in a
    separate process.
    """
    check_contract(system)
    if not cpu_dispatch.pin():
        # NumPy was loaded earlier, and computes with other instructions than a search.
        options = {
            "seconds": seconds,
            "map": map,
            "deterministic": deterministic,
            "limit_s": limit_s,
            "marker": marker and dataclasses.asdict(marker),
            "start": start and dataclasses.asdict(start),
            "domain": domain,
            "limits": limits and dataclasses.asdict(limits),
            "probes": probes,
        }
        values = call_in_separate_process("pytest_garl.testing:_check_as_values", system, options)
        return dataclass_from(Check, values)
    plan = plan_for(map=map, marker=marker, start=start, domain=domain, limits=limits)
    plan = dataclasses.replace(
        plan, seconds=seconds, deterministic=deterministic, limit_s=limit_s, probes=probes
    )
    return check_as_planned(system, plan)


def plan_for(
    *,
    map: str,
    marker: MarkerSpec | None = None,
    start: Start | None = None,
    domain: str = DEFAULT_DOMAIN,
    limits: Limits | None = None,
) -> CheckPlan:
    """Return the plan for a class that no test names: what is not given is a test's default."""
    ground = load_map(map, (Path.cwd() / "scenarios" / "maps",))
    spec = marker or ground.marker
    return CheckPlan(
        map=ground,
        task=Task(marker=spec, start=start or Start()),
        domain=domain_with_policy(domain, Path.cwd()),
        limits=limits or Limits(distance_m=default_distance_m(spec.side_m)),
    )


def check_as_planned(system: AnySystem, plan: CheckPlan) -> Check:
    """Fly a class as a plan says, as ``check_landing_system`` does, in this process."""
    check_contract(system)
    return _Checker(system, plan).run()


def check_contract(system: AnySystem) -> None:
    """Raise LandingSystemError if a class has not the methods and the airframe of the contract.

    A program is asked whether it can be started.
    """
    check_system(system)
    if isinstance(system, ProgramSystem):
        return
    _check_airframe(system)
    if hasattr(system, "observe_truth") and not is_own(system):
        raise LandingSystemError(
            f"{system.__name__}: has an attribute observe_truth, the name by which pilots of "
            "pytest-garl are told where the marker is; a landing system is not told, so give it "
            "another name"
        )
    _check_signature(system, "reset", 1)
    _check_signature(system, "step", 1)


def _check_as_values(
    system: AnySystem,
    marker: dict[str, Any] | None,
    start: dict[str, Any] | None,
    limits: dict[str, Any] | None,
    **options: Any,
) -> dict[str, Any]:
    found = check_landing_system(
        system,
        marker=dataclass_from(MarkerSpec, marker) if marker else None,
        start=dataclass_from(Start, start) if start else None,
        limits=dataclass_from(Limits, limits) if limits else None,
        **options,
    )
    return dataclasses.asdict(found)


class _TimedFlight(NamedTuple):
    flight: Flight
    cpu_s: float


class _Checker:
    """Flies one class in a calm scenario and in a drawn one, both without moving objects."""

    def __init__(self, system: AnySystem, plan: CheckPlan) -> None:
        self._system, self._plan = system, plan
        self._longest_s = time_limit_s(plan.limits)
        self._seconds = plan.seconds or self._longest_s
        self._whole = plan.seconds is None or plan.seconds >= self._longest_s
        self._map = plan.map
        self._calm, self._drawn = _scenarios(plan)
        self._limit_s = plan.limit_s
        self._meter = CallMeter(plan.limit_s)
        self._warnings: list[str] = []
        self._faults: list[str] = []
        self._probed: list[ProbeResult] = []
        self._output: ProgramOutput | None = None

    def run(self) -> Check:
        """Fly the scenarios and compare the flights."""
        flights: list[str] = []
        cpu_s = longest_cpu_s = self._limit_s
        # Another process judges: a landing system may replace in this one what judges.
        with JudgeProcess() as judge, _warning_of_leftovers(self._warnings.append):
            try:
                first = self._fly(self._system, self._calm, self._seconds, keeps="")
                result = judge.judge_flight(first.flight, self._plan.limits)
                flights.append(
                    f"{self._map.name}: {self._ending(first.flight, result, self._seconds)}"
                )
                cpu_s = first.cpu_s
                longest_cpu_s = cpu_s * self._longest_s / max(SHORTEST_S, first.flight.elapsed_s)
                self._note_result(first, result)
                other, seconds = self._compare(first)
                drawn = judge.judge_flight(other.flight, self._plan.limits)
                ending = self._ending(other.flight, drawn, seconds)
                flights.append(f"{self._map.name}, another scenario: {ending}")
                self._probe(judge, first.flight)
                if {result.outcome, drawn.outcome} == {"gave_up"}:
                    self._warnings.append("gave up in both scenarios; a search would learn nothing")
            except OutOfTimeError:
                self._warnings.append(self._unflown(len(flights)))
        if self._meter.slowest_s > SLOW_CALL_S:
            self._warnings.append(
                f"one call took {self._meter.slowest_s:.1f} s of computing; a search ends a call "
                "of 10 s (--garl-timeout)"
            )
        return Check(
            system=self._system.__name__,
            flights=tuple(flights),
            warnings=tuple(self._warnings),
            faults=tuple(self._faults),
            probes=tuple(self._probed),
            task=self._task_text(),
            cpu_s=cpu_s,
            longest_s=self._longest_s,
            longest_cpu_s=longest_cpu_s,
        )

    def _ending(self, flight: Flight, result: FlightResult, seconds: float) -> str:
        if seconds < self._longest_s and flight.outcome == "not_landed":
            place = _place(flight, flight.elapsed_s)
            why = "--seconds" if seconds == self._plan.seconds else "so that the check ends in time"
            return f"cut off after {seconds:.3g} s ({why}), {place}"
        return _landed(flight, result) or result.verdict.story

    def _task_text(self) -> str:
        """Return what lies there, and what it is looked at with."""
        marker = self._plan.task.marker or self._map.marker
        camera = airframe_of(self._system).camera
        degrees = math.degrees(camera.field_of_view_rad)
        return (
            f"{self._map.name}: the marker is {marker.dictionary} id {marker.id}, "
            f"{marker.side_m:g} m wide; the camera has {camera.width_px}x{camera.height_px} "
            f"pixels, {camera.rate_hz:g} Hz, {degrees:.0f} degrees from left to right"
        )

    def _unflown(self, told: int) -> str:
        """Return a warning that names what was not flown; ``told`` scenarios were."""
        left = ["clear air", "another scenario and both again"][told:]
        if self._plan.probes:
            left.append("the other probes" if self._probed else "the probes")
        return f"stopped after {self._limit_s:g} s of computing; not flown: {', '.join(left)}"

    def _probe(self, judge: JudgeProcess, twin: Flight) -> None:
        """Fly the probes of a system that lands in clear air, with fresh instances."""
        plan = self._plan
        if not plan.probes or not self._whole or self._faults:
            return
        self._meter.allow(plan.limit_s)
        beside = start_beside(self._calm, plan.map, plan.domain)
        base, scenario = twin, self._calm
        found, flight = self._fly_probe(judge, beside)
        if flight.outcome == "landed" and not found.violated:
            base, scenario = flight, beside.scenario
        camera = airframe_of(self._system).camera
        others = probes_for(base, scenario, plan.map, plan.domain, plan.limits, camera)
        # Some are the flight in clear air, or the one beside the marker.
        flown = (self._calm, beside.scenario)
        for each in others:
            if each.scenario not in flown:
                self._fly_probe(judge, each)

    def _fly_probe(self, judge: JudgeProcess, probe: Probe) -> tuple[ProbeResult, Flight]:
        flight = self._fly(self._system, probe.scenario, self._seconds, raises=False).flight
        judged = judge.judge_flight(flight, self._plan.limits)
        result = ProbeResult(
            name=probe.name,
            sentence=probe.sentence,
            ending=_landed(flight, judged) or probe.ending(judged.verdict),
            violated=probe.is_violated(judged.verdict),
            outside=probe.outside,
        )
        self._probed.append(result)
        return result, flight

    def _compare(self, first: _TimedFlight) -> tuple[_TimedFlight, float]:
        """Fly both scenarios with fresh instances and with one that flies them all.

        Returns the flight of the second one, and the simulated time after which it was to end.
        """
        seconds = self._seconds
        if 5 * first.cpu_s > self._limit_s:
            share = (self._limit_s - first.cpu_s) / (6 * first.cpu_s)
            seconds = max(SHORTEST_S, share * first.flight.elapsed_s)
            first = self._fly(self._system, self._calm, seconds)
        other = self._fly(self._system, self._drawn, seconds, keeps="-another")
        yaws: list[tuple[float, float]] = []
        reused = _reusing_one_instance(self._system, yaws)
        try:
            for fresh, scenario, problem in (
                (first, self._calm, "two flights of the same scenario differ"),
                (other, self._drawn, _REMEMBERS),
                (first, self._calm, _REMEMBERS),
            ):
                again = self._fly(reused, scenario, seconds)
                self._check_yaw(again.flight, yaws)
                self._check_equal(fresh.flight, again.flight, problem)
        finally:
            reused.close_instance()
        return other, seconds

    def _check_yaw(self, flight: Flight, yaws: list[tuple[float, float]]) -> None:
        """Refuse a heading of several turns, which radians rarely are."""
        if yaws:
            time_s, yaw = yaws[0]
            raise LandingSystemError(
                f"{self._system.__name__}.step: {_place(flight, time_s)}: returned yaw_rad = "
                f"{yaw:g}; expected radians from -2π to 2π. Are these degrees? "
                f"math.radians({yaw:g}) is {math.radians(yaw):.3g}"
            )

    def _check_equal(self, fresh: Flight, again: Flight, problem: str) -> None:
        if fresh.sha256 == again.sha256:
            return
        text = (
            f"{self._system.__name__}: {problem}, first at {divergence_time_s(fresh, again):.2f} s"
        )
        if self._plan.deterministic:
            raise LandingSystemError(
                f"{text}; if that is intended, pass deterministic=False here and in the marker"
            )
        if text not in self._warnings:
            self._warnings.append(text)

    def _note_result(self, first: _TimedFlight, result: FlightResult) -> None:
        """Note whether it lands in clear air, and warn of problems that a search would have."""
        flight, warn, verdict = first.flight, self._warnings.append, result.verdict
        if self._whole and (verdict.violation or not verdict.completed):
            why = why_no_landing(Evidence(flight, self._plan.limits), verdict)
            if isinstance(self._system, CompanionProgram) and self._saw_nothing(flight):
                why += f" {WHERE_TO_FLY}"
            if isinstance(self._system, CompanionProgram) and NEVER_OFF in why:
                why += f" {TAKES_OVER}"
            self._faults.append(
                f"your system does not land in clear air, on {self._map.name} without moving "
                f"objects: {why} A search would report that again and again."
                f"{_printed_text(self._output)}"
            )
        touchdown = flight.touchdown
        if touchdown and touchdown.stopped_s is None and result.outcome == "not_landed":
            warn(
                "touched the ground, but its motors did not stop; that takes Land(), or a thrust "
                "below 30 % of that of a hover for 1 s"
            )
        if not any(step.diagnostics for step in flight.steps):
            warn(
                "returns no diagnostics: reports cannot say what it saw or intended to do. Return "
                f"with each command {self._diagnostics_example()}: the place that it takes for the "
                "marker, the markers that it sees in the frame, what it does"
            )
        elif self._whole and not (Evidence(flight).reports_anything or self._saw_nothing(flight)):
            warn(
                "its diagnostics never name a detection (Diagnostics.detections) or a target "
                "(Diagnostics.target_m)"
            )
        if first.cpu_s > SLOW_FLIGHT_S:
            # A program computes between the calls, too.
            calls = f", {self._meter.mean_s * 1e3:.0f} ms in each call"
            warn(
                f"slow: {first.cpu_s:.0f} s of computing for {flight.elapsed_s:.0f} s of flight"
                f"{'' if isinstance(self._system, ProgramSystem) else calls}"
            )

    def _diagnostics_example(self) -> str:
        if isinstance(self._system, ProgramSystem):
            return '"diagnostics": {"target_m": [x, y, 0], "detections": [...], "phase": "..."}'
        return "diagnostics=Diagnostics(target_m=(x, y, 0.0), detections=..., phase=...)"

    def _fly(
        self,
        system: Any,
        scenario: Scenario,
        seconds: float,
        *,
        raises: bool = True,
        keeps: str | None = None,
    ) -> _TimedFlight:
        """Fly a scenario; with ``keeps``, the end of a file's name, keep what a program prints."""
        began = _cpu_s()
        with (
            self._keeping_output(keeps),
            self._meter.timed(),
            refusing_end(self._system.__name__),
        ):
            flight = fly(
                scenario,
                system,
                policy_spec("stationary"),
                map=self._map,
                time_limit_s=seconds,
                guard=self._meter,
            )
        if flight.crash is not None and raises:
            crash, hint = flight.crash, ""
            if "read-only" in crash.message:
                hint = "; observations are read-only, copy the array before changing it"
            saw = f"{seen_text(Evidence(flight))}\n" if flight.steps else ""
            what = f"{crash.error}: {crash.message}{hint}\n{saw}{self._task_text()}"
            what = f"{what}\n{crash.traceback}".rstrip()
            printed = _printed_text(self._output, lines=0 if crash.traceback else LAST_LINES)
            raise LandingSystemError(f"{crash.where}: {_last_place(flight)}: {what}{printed}")
        return _TimedFlight(flight, _cpu_s() - began)

    def _saw_nothing(self, flight: Flight) -> bool:
        """Whether the system looked at pictures, and the marker could be read in none of them."""
        looked = flight.data_read is None or "image" in flight.data_read
        return looked and not Evidence(flight).readable

    @contextlib.contextmanager
    def _keeping_output(self, keeps: str | None) -> Iterator[None]:
        """Keep what a program prints, in a file below the folder of runs, if it can be written."""
        program, self._output = self._system, None
        if keeps is None or not isinstance(program, ProgramSystem):
            yield
            return
        file = Path(RUN_FOLDER, "check", f"{program.name}-{self._map.name}{keeps}.log")
        with contextlib.suppress(OSError):
            self._output = program.output = ProgramOutput(file)
        try:
            yield
        finally:
            program.output = None


def _cpu_s() -> float:
    """Return the CPU time of this process, and of those that it has started and that have ended."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


_REMEMBERS = (
    "a later flight of one instance differs from the first of a fresh one; reset(mission) must "
    "forget the flight before"
)


def _landed(flight: Flight, result: FlightResult) -> str:
    """Return where and when a flight landed; empty if it did not, or violates something."""
    touchdown = flight.touchdown
    if result.outcome == "landed" and touchdown and not result.verdict.violation:
        return f"landed {touchdown.distance_m:.2f} m off after {touchdown.time_s:.0f} s"
    return ""


def _printed_text(output: ProgramOutput | None, lines: int = LAST_LINES) -> str:
    """Return the last lines that a program printed, and the file with all of them."""
    if output is None:
        return ""
    last = output.last_lines(LAST_LINES)
    if not last:
        return "\nThe program printed nothing."
    shown = [f"    {shortened(line, LINE_CHARS)}" for line in last[-lines:]] if lines else []
    printed = ["The program printed last:", *shown] if shown else []
    return "\n".join(["", *printed, f"All that it printed: {output.file}"])


def _scenarios(plan: CheckPlan) -> tuple[Scenario, Scenario]:
    """Return the domain's mildest scenario and one that a search might draw; no NPC is there."""
    clear = clear_scenario(plan.map, plan.task, plan.domain)
    genome = genome_of(plan.domain, plan.map, plan.task)
    drawn = random_scenarios(plan.map, genome, 1, 0, 1)[0]
    return clear, without_objects(drawn, plan.map)


def _last_place(flight: Flight) -> str:
    """Return when and where a flight ended that an error ended."""
    if not flight.steps:
        return "before its first command"
    phase = next((s.diagnostics.phase for s in reversed(flight.steps) if s.diagnostics), "")
    own = f"; its own phase was {shown_foreign(phase)}" if phase else ""
    return f"{_place(flight, flight.elapsed_s)}{own}"


def _place(flight: Flight, time_s: float) -> str:
    """Return such as ``at 14.0 s, in the phase descent, 4.6 m up and 0.3 m from the marker``."""
    phase = Evidence(flight).phase_at(time_s)
    return f"at {time_s:.1f} s, in the phase {phase}, {place_beside_marker(flight, time_s)}"


def _check_airframe(system: type) -> None:
    controls_motors = callable(getattr(system, "control", None))
    if controls_motors != (airframe_of(system).control_rate_hz is not None):
        raise LandingSystemError(
            f"{system.__name__}: a method control(state) and Airframe(control_rate_hz=...) belong "
            "together; found only one of them"
        )


def _check_signature(system: type, method: str, count: int) -> None:
    code = getattr(system, method)
    if inspect.iscoroutinefunction(code) or inspect.isasyncgenfunction(code):
        raise LandingSystemError(
            f"{system.__name__}.{method} is `async def`; expected a plain `def`: the simulator "
            "calls it once for each camera frame and waits for no event loop. Run your own loop "
            "in it, as loop.run_until_complete(...)"
        )
    try:
        inspect.signature(code).bind(*[None] * (count + 1))
    except TypeError as error:
        raise LandingSystemError(
            f"{system.__name__}.{method}: {error}; expected one argument beside self"
        ) from error


@contextlib.contextmanager
def _warning_of_leftovers(warn: Callable[[str], None]) -> Iterator[None]:
    """Warn of threads and processes that a landing system leaves running."""
    threads, processes = set(threading.enumerate()), descendants_of(os.getpid())
    yield
    left = [item for item in threading.enumerate() if item not in threads and item.is_alive()]
    if left:
        warn(f"leaves {len(left)} threads running ({left[0].name})")
    started = descendants_of(os.getpid()) - processes
    if started:
        warn(f"leaves {len(started)} processes running; a search ends them after each flight")


def _reusing_one_instance(system: AnySystem, yaws: list[tuple[float, float]]) -> Any:
    """Return a stand-in for the class that always gives the same instance.

    It notes time and value of each commanded yaw beyond a full turn.
    """
    instances: list[Any] = []

    class Reused(PilotWrapper):
        airframe = airframe_of(system)

        def __init__(self) -> None:
            if not instances:
                instances.append(system())
            self.wrapped = instances[0]

        def __getattr__(self, name: str) -> Any:
            return getattr(self.wrapped, name)

        def reset(self, mission: Mission) -> None:
            self.wrapped.reset(mission)

        def step(self, observation: Observation) -> Any:
            answer = self.wrapped.step(observation)
            if isinstance(answer, PositionSetpoint | VelocitySetpoint):
                yaw = finite(answer.yaw_rad)
                if yaw is not None and abs(yaw) > LARGEST_YAW_RAD:
                    yaws.append((observation.time_s, yaw))
            return answer

        def close(self) -> None:
            """Leave the instance open for its next flight."""

        @staticmethod
        def close_instance() -> None:
            """Close the instance after its last flight."""
            for instance in instances:
                getattr(instance, "close", lambda: None)()

    Reused.__name__ = system.__name__
    return Reused
