"""Make a case from a failing scenario."""

from __future__ import annotations

import dataclasses

from pytest_garl.cases.case import (
    NOT_ASKED,
    Case,
    CaseEvidence,
    NoGateReason,
    Prevention,
    Violation,
)
from pytest_garl.cases.description import violation_in
from pytest_garl.cases.user_failure import UserFailure
from pytest_garl.execution.reference import simulator_sha256
from pytest_garl.execution.severity import NO_SEVERITY, Severity
from pytest_garl.execution.severity_of_flight import severity_of
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import load
from pytest_garl.shrinking.case_comparison import Removed, all_removed
from pytest_garl.shrinking.case_flights import recorded_behaviour, without_idle
from pytest_garl.shrinking.case_request import CaseRequest, CaseResult, FailingScenario
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.verdicts.verdict import Verdict


def case_without_flights(request: CaseRequest) -> CaseResult:
    """Return the simplest violation of the search as a case, without another flight.

    Its objects repeat their moves to the last digit, so that it has the flight of the search.  A
    finding, which went wrong before a flight's end, is no case until another flight shows it.
    """
    if request.finding:
        return CaseResult(
            signature=request.signature,
            case=None,
            flights=0,
            reason="not flown again without people, dogs and birds: no flights are left",
            finding=request.finding,
        )
    origin = request.simplest
    flight = dict(request.violations)[origin]
    scenario = without_idle(request, origin, flight)
    failing = FailingScenario(
        origin=origin,
        scenario=scenario,
        behaviour=recorded_behaviour(flight, scenario, request.map),
        flight=flight,
    )
    case = new_case(request, failing)
    return CaseResult(signature=request.signature, case=case, flights=0)


def new_case(
    request: CaseRequest,
    failing: FailingScenario,
    prevention: Prevention = NOT_ASKED,
    untried: tuple[str, ...] = (),
) -> Case:
    """Return the case of a failing scenario.

    ``untried`` names what shrinking did not try to remove.
    """
    completed, job = failing.flight, request.job
    flight = load(completed.record) if completed.record.exists() else None
    ask = request.user_assertion
    failure = ask(completed, failing.scenario) if ask else None
    npcs = failing.npcs or job.npcs
    severity = dataclasses.replace(_severity(request, failing, flight, npcs), untried=untried)
    is_shrunk = failing.is_shrunk and not severity.is_guess
    return Case(
        system=job.system.name,
        status="open",
        reason=_reason(failing, prevention),
        live=prevention.answer == "preventable" and npcs.reads_uav,
        prevention=prevention,
        scenario=failing.scenario,
        violation=_own_violation(failure, completed.result.verdict)
        if failure is not None
        else violation_in(completed.result.verdict, flight, severity, is_shrunk=is_shrunk),
        policy=npcs.name,
        policy_sha256=npcs.sha256,
        moves=failing.behaviour.moves,
        changes=failing.behaviour.changes,
        evidence=CaseEvidence(
            trajectory_sha256=completed.sha256,
            cpu=flight.cpu if flight else "",
            map_sha256=job.map_sha256,
            neighbours=failing.neighbours_flown,
            neighbours_failed=failing.neighbours_failed,
            removed=Removed.between(failing.origin, failing.scenario).text,
            versions=flight.versions if flight else (),
            system_sha256=job.system_sha256,
            simulator_sha256=simulator_sha256(job.simulator),
            engine=job.engine,
        ),
        limits=job.limits,
        test=request.test or (failure.test if failure else ""),
        assertion=failure.assertion if failure else "",
        severity=severity,
    )


def replacing_case(
    saved: Case,
    request: CaseRequest,
    failing: FailingScenario,
    prevention: Prevention,
    untried: tuple[str, ...],
) -> Case:
    """Return the case of a failing scenario that replaces a saved one."""
    if saved.is_shrunk:
        # Steps that were tried when it was saved need not be tried again.
        untried = tuple(name for name in untried if name in saved.severity.untried)
    found = new_case(request, failing, prevention, untried)
    removed = all_removed(saved.evidence.removed, found.evidence.removed)
    return dataclasses.replace(
        found,
        status=saved.status,
        live=saved.live if prevention == NOT_ASKED else found.live,
        accepted=saved.accepted,
        worst=saved.worst,
        policy=saved.policy,
        policy_sha256=saved.policy_sha256,
        evidence=dataclasses.replace(found.evidence, removed=removed),
    )


def _severity(
    request: CaseRequest, failing: FailingScenario, flight: Flight | None, npcs: PolicySpec
) -> Severity:
    """Return the severity, by the policy that moved the objects when their moves were recorded."""
    result = failing.flight.result
    found = result.severity
    if flight is not None:
        found = severity_of(flight, result.verdict, failing.scenario, request.map, npcs)
    return dataclasses.replace(found or NO_SEVERITY, window_s=failing.window_s)


def _reason(failing: FailingScenario, prevention: Prevention) -> NoGateReason:
    """Return why the case gates nothing; empty if it gates."""
    if not failing.is_robust:
        return "edge"
    answer = prevention.answer
    return answer if answer in ("sensor-limited", "unpreventable") else ""


def _own_violation(failure: UserFailure, verdict: Verdict) -> Violation:
    """Return the violation of a test's own assertion."""
    return Violation(
        signature=failure.signature,
        type="own",
        property="own",
        margin=0.0,
        unit="1",
        description=f"{failure.test}: {failure.message}. {verdict.story}",
    )
