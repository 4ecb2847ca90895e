"""From a flight that failed to the case that is saved."""

from __future__ import annotations

from pytest_garl.execution.reference import simulator_sha256
from pytest_garl.execution.result import CompletedFlight
from pytest_garl.regressions.case import Avoidable, Case, Evidence, RecordedBehaviour, Violation
from pytest_garl.regressions.case_request import (
    CaseRequest,
    CaseResult,
    Failure,
    simplest_first,
)
from pytest_garl.regressions.description import tell
from pytest_garl.regressions.shrink import complexity, genome_of
from pytest_garl.regressions.user_failure import UserFailure
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.flight import Flight
from pytest_garl.simulation.flight_file import load
from pytest_garl.verdicts.verdict import Verdict


def as_found(request: CaseRequest) -> CaseResult:
    """Return the search's own flight as a case, without another flight."""
    scenario = simplest_first(request)[0]
    done = dict(request.violations)[scenario]
    failure = unasked(scenario, scenario, recorded_behaviour(done, scenario, request.map), done)
    case = case_of(request, failure, nobody_asked(failure))
    return CaseResult(signature=request.signature, case=case, flights=0)


def unasked(
    first: Scenario, scenario: Scenario, behaviour: RecordedBehaviour, done: CompletedFlight
) -> Failure:
    """Return a failure of which no neighbour was flown."""
    return Failure(
        first=first, scenario=scenario, behaviour=behaviour, done=done, robust=0, asked=0
    )


def nobody_asked(failure: Failure) -> Avoidable:
    """Return what may be demanded without asking the reference pilot: where nothing moves, all."""
    return "recorded" if failure.behaviour.moves else "live"


def case_of(request: CaseRequest, failure: Failure, avoidable: Avoidable) -> Case:
    """Return a failure as what is saved."""
    done, job = failure.done, request.job
    flight = load(done.record) if done.record.exists() else None
    ask = request.user_assertion
    own = ask(done.result, done.record, failure.scenario) if ask else None
    return Case(
        system=job.system.name,
        status="unavoidable" if avoidable == "no" else "open",
        avoidable=avoidable,
        scenario=failure.scenario,
        violation=_violation(done.result.verdict, flight, own),
        policy=job.npcs.name,
        policy_sha256=job.npcs.sha256,
        moves=failure.behaviour.moves,
        changes=failure.behaviour.changes,
        evidence=Evidence(
            trajectory_sha256=done.sha256,
            cpu=flight.cpu if flight else "",
            map_sha256=job.map_sha256,
            neighbours=failure.asked,
            neighbours_failed=failure.robust,
            removed=removed(failure.first, failure.scenario, request.map),
            versions=flight.versions if flight else (),
            system_sha256=job.system_sha256,
            simulator_sha256=simulator_sha256(job.simulator),
        ),
        limits=job.limits,
        test=request.test or (own.test if own else ""),
        assertion=own.assertion if own else "",
    )


def _violation(verdict: Verdict, flight: Flight | None, own: UserFailure | None) -> Violation:
    """Return what failed, from the verdict or from the test's own assertion."""
    if own is not None:
        return Violation(
            signature=own.signature,
            type="own",
            property="own",
            margin=0.0,
            unit="1",
            story=f"{own.test}: {own.message}. {verdict.story}",
        )
    assert verdict.primary is not None
    assert verdict.violation_type is not None
    margin = next((each for each in verdict.margins if each.property == verdict.primary), None)
    return Violation(
        signature=verdict.signature,
        type=verdict.violation_type,
        property=verdict.primary,
        margin=margin.value if margin else 0.0,
        unit=margin.unit if margin else "1",
        story=tell(flight, verdict) if flight else verdict.story,
    )


def recorded_behaviour(done: CompletedFlight, scenario: Scenario, map: Map) -> RecordedBehaviour:
    """Return what each object did in a flight; nothing where its process did not live."""
    names = [name for name, _ in map.without(scenario.removed_objects).object_names]
    if not done.record.exists():
        return RecordedBehaviour(moves=tuple((name, ()) for name in names))
    objects = load(done.record).objects
    made = {item.name: item.moves for item in objects}
    return RecordedBehaviour(
        moves=tuple(
            (name, tuple((float(x), float(y)) for x, y in made.get(name, ()))) for name in names
        ),
        changes=tuple((item.name, item.changes) for item in objects if item.changes),
    )


def find_colliding_object(done: CompletedFlight) -> str:
    """Return the moving object that the UAV hit, if it did."""
    hit, kind = done.result.collisions, done.result.verdict.violation_type
    return hit[-1] if hit and kind == "IV" else ""


def removed(first: Scenario, last: Scenario, map: Map) -> str:
    """Say what shrinking took away."""
    before, after = (complexity(each, genome_of(first, map)) for each in (first, last))
    if before == after:
        return "nothing"
    objects, genes = before[0] - after[0], before[1] - after[1]
    return f"{objects} of {before[0]} objects, {genes} of {before[1]} genes off nominal"
