"""Fly one scenario as a job says, and judge its record: two steps, for two processes.

The flight runs the landing system's code, which may replace any function of its process.  So the
record is all that leaves that process, and another one, which never runs that code, judges it.
"""

from __future__ import annotations

import dataclasses
import math
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pytest_garl import engine
from pytest_garl.errors import LandingSystemError
from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.reference import BUILT_IN
from pytest_garl.execution.result import FlightResult, broken_result
from pytest_garl.flight.flight import Crash, Touchdown
from pytest_garl.scenarios.groups import QUANTITIES
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.verdicts.verdict import PAPER_LIMITS

if TYPE_CHECKING:
    from pytest_garl.flight.flight import Flight
    from pytest_garl.verdicts.evidence import Evidence
    from pytest_garl.verdicts.verdict import Limits


@dataclass(frozen=True, slots=True, kw_only=True)
class FlownJob:
    """What a flight left: its record, or the reason why there is none.

    ``refusal`` is that reason: the flight held a number that is not finite.
    """

    wall_s: float
    refusal: str = ""


def fly_and_save(job: FlightJob, scenario: Scenario, flight: FlightId, guard: Any) -> FlownJob:
    """Fly, and save the record; that of an earlier attempt is removed first.

    Raises LandingSystemError if this process cannot import the landing system.
    """
    from pytest_garl.errors import NotFiniteError
    from pytest_garl.flight.flight_file import save
    from pytest_garl.simulation.system_under_test.takeover import with_takeover

    record = job.record(flight)
    record.unlink(missing_ok=True)
    for entry in job.path:
        if entry not in sys.path:
            sys.path.append(entry)
    engine.prefer(job.engine)
    map = job.load_map()
    system = _loaded(job)
    if job.takeover is not None:
        system = with_takeover(system, job.takeover)
    flown = job.simulator.load()(
        scenario,
        system,
        job.npcs,
        map=map,
        time_limit_s=time_limit_s(job.limits),
        guard=guard,
    )
    try:
        save(flown, record)
    except NotFiniteError as error:
        return FlownJob(wall_s=flown.wall_s, refusal=str(error))
    return FlownJob(wall_s=flown.wall_s)


def _loaded(job: FlightJob) -> Any:
    """Return the landing system; raise LandingSystemError if this process cannot import it."""
    try:
        return job.system.load()
    except Exception as error:
        raise LandingSystemError(
            f"{job.system.name} cannot be imported by its name: {type(error).__name__}: {error}"
        ) from error


def judge_record(
    job: FlightJob, scenario: Scenario, flight: FlightId, flown: FlownJob
) -> tuple[FlightResult, str, float]:
    """Return the result of a flight, its trajectory's hash and its wall time, from its record.

    A flight that was refused is a finding.  Raises GarlError if the record cannot be read.
    """
    from pytest_garl.execution.severity_of_flight import severity_of
    from pytest_garl.flight.flight_file import load
    from pytest_garl.simulation.landing_moments import decided_genes

    map = job.load_map()
    if flown.refusal:
        crash = Crash(kind="nonsense", error="NotFinite", message=flown.refusal)
        return broken_result(crash, map.diagonal_m), "", flown.wall_s
    record = load(job.record(flight))
    if job.simulator == BUILT_IN:
        record = measured(record)
    result = judged(record, job.limits)
    decided = decided_genes(scenario, record, job.npcs)
    # It tells when an event struck, and not that somebody decided it.
    struck = {key: value for key, value in decided if key in QUANTITIES}
    severity = severity_of(record, result.verdict, scenario.replace(struck), map, job.npcs)
    result = dataclasses.replace(result, severity=severity, decided=decided)
    return result, record.sha256, record.wall_s


def measured(flight: Flight) -> Flight:
    """Return a record of the built-in simulator with distances that this process has measured.

    They are the same to the byte unless the landing system replaced ``math.dist`` in its process.
    """
    marker = flight.marker_position_m
    x, y = (float(value) for value in flight.uav.position_m[-1, :2])

    def again(touchdown: Touchdown) -> Touchdown:
        distance_m = math.dist(touchdown.position_m[:2], marker)
        return dataclasses.replace(touchdown, distance_m=distance_m)

    return dataclasses.replace(
        flight,
        final_distance_m=math.dist((x, y), marker),
        touchdown=again(flight.touchdown) if flight.touchdown else None,
        earlier_touchdowns=tuple(again(each) for each in flight.earlier_touchdowns),
    )


def fly_job(
    job: FlightJob, scenario: Scenario, flight: FlightId, guard: Any
) -> tuple[FlightResult, str, float]:
    """Fly and judge in this process: for a landing system that is known to replace nothing."""
    return judge_record(job, scenario, flight, fly_and_save(job, scenario, flight, guard))


def time_limit_s(limits: Limits) -> float:
    """Return the simulated time after which a flight ends: the paper's limit, or a longer one."""
    return max(PAPER_LIMITS.time_s, limits.time_s)


def judged(flight: Flight, limits: Limits) -> FlightResult:
    """Return the result of a flight, without the severity of a violation."""
    from pytest_garl.verdicts.evidence import Evidence
    from pytest_garl.verdicts.judge import closest_call, verdict_on, why_undecided

    evidence = Evidence(flight, limits)
    call, body = closest_call(evidence)
    collided = flight.outcome == "collision"
    result = FlightResult(
        outcome=flight.outcome,
        final_distance_m=flight.final_distance_m,
        elapsed_s=flight.elapsed_s,
        # A soft touchdown before is no collision.
        collisions=tuple(
            contact.body
            for contact in flight.contacts
            if contact.body_class != "ground" or contact is flight.contacts[-1]
        )
        if collided
        else (),
        undecided=why_undecided(flight),
        off_marker_m=evidence.off_marker_m,
        closest_call=call,
        closest_body=body,
        verdict=verdict_on(evidence),
        crash=flight.crash,
        landed_s=evidence.landed_s if flight.outcome == "landed" else None,
    )
    return _of_held(evidence, result) if evidence.holds else result


def _of_held(evidence: Evidence, result: FlightResult) -> FlightResult:
    """Return the result of a flight whose UAV held its place: plans and targets are its landing.

    One event fails one test, so values of other properties than the violated one are within limits.
    """
    from pytest_garl.verdicts.held import NOTHING_REPORTED, Held

    if result.outcome == "crashed":
        return result
    held, primary = Held(evidence), result.verdict.primary
    if held.could_report and not held.reports_anything:
        return dataclasses.replace(result, outcome="inconclusive", undecided=NOTHING_REPORTED)
    off_m = held.off_marker_m
    if off_m is not None and primary != "distance":
        off_m = min(off_m, evidence.limits.distance_m)
    return dataclasses.replace(
        result,
        collisions=held.through if primary == "collision" else (),
        undecided=result.undecided if held.on_marker_s is None else "",
        off_marker_m=off_m,
        landed_s=held.on_marker_s,
    )
