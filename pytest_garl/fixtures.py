"""The fixtures of a landing test: landing, scenario, npcs."""

from __future__ import annotations

import functools
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.switches import FATAL, RUN

if TYPE_CHECKING:
    from pytest_garl.scenarios.scenario import Scenario
    from pytest_garl.simulation.flight import Flight
    from pytest_garl.simulation.policy import PolicySpec
    from pytest_garl.targets import Target
    from pytest_garl.verdicts.verdict import Limits, Verdict


class Landing:
    """One flown landing, as a test sees it.

    Reading a property that the flight did not decide skips the test with the reason;
    ``final_distance_m`` and ``elapsed_s`` can always be read.
    """

    def __init__(self, target: Target, result: dict[str, Any], record: Path) -> None:
        self._target, self.result, self._record = target, result, record
        self.slot: str = target.name
        self.outcome: str = result["outcome"]
        self.final_distance_m: float = result["final_distance_m"]
        self.elapsed_s: float = result["elapsed_s"]

    def __repr__(self) -> str:
        from pytest_garl.verdicts.headline import headline

        return f"<Landing {self.slot}: {headline(self.verdict.story)}>"

    @property
    def limits(self) -> Limits:
        """The limits of the marker."""
        return self._target.limits

    @property
    def distance_to_landing_m(self) -> float:
        """Horizontal distance from the UAV to the marker's centre where it landed.

        Where it touched the ground too far off before it gave up, that place counts.
        """
        if self.outcome == "landed":
            return self.final_distance_m
        touched: float | None = self.result.get("off_marker_m")
        if touched is None:
            self._undecided()
        return touched

    @property
    def time_to_landing_s(self) -> float:
        """Time from the mission's start to the landing; infinite if it never landed."""
        if self.outcome == "not_landed":
            return math.inf
        if self.outcome != "landed":
            self._undecided()
        if self.verdict.primary == "distance":
            # One event, one failing test: what landed elsewhere is not late as well.
            return min(self.elapsed_s, self.limits.time_s)
        return self.elapsed_s

    @property
    def collisions(self) -> tuple[str, ...]:
        """Names of the bodies that the UAV hit; "ground" for a hard touchdown."""
        return tuple(self.result["collisions"])

    @functools.cached_property
    def verdict(self) -> Verdict:
        """The built-in judgement."""
        from pytest_garl.verdicts.serialise import from_dict

        return from_dict(self.result["verdict"])

    @functools.cached_property
    def flight(self) -> Flight:
        """The flight's whole record, loaded from its file."""
        from pytest_garl.simulation.record import load

        return load(self._record)

    def _undecided(self) -> NoReturn:
        pytest.skip(f"not decided: {self.result['undecided']}")


@pytest.fixture
def garl_slot(request: pytest.FixtureRequest) -> Target:
    """Return the slot that the item tests."""
    target: Target | str = request.param
    if isinstance(target, str):
        pytest.skip(target)
    if target.broken:
        pytest.fail(target.broken, pytrace=False)
    return target


@pytest.fixture(scope="session")
def npcs(request: pytest.FixtureRequest) -> PolicySpec:
    """Return who moves the dynamic objects; override it in a conftest.py to change that."""
    from pytest_garl.adversary.policies import policy_spec

    run = request.config.stash.get(RUN, None)
    return policy_spec(run.options.npcs if run else "dqn")


def stop(item: pytest.Item, error: GarlError) -> NoReturn:
    """End the session: without ledger or policy no other item would fare better."""
    if not hasattr(item.config, "workerinput"):
        pytest.exit(f"garl: {error}", returncode=pytest.ExitCode.INTERNAL_ERROR)
    item.user_properties.append((FATAL, str(error)))
    pytest.fail(f"garl: {error}", pytrace=False)


@pytest.fixture
def landing(request: pytest.FixtureRequest, garl_slot: Target, npcs: PolicySpec) -> Landing:
    """Return the slot's landing, flown when it is first asked for."""
    run = request.config.stash[RUN]
    try:
        result = run.fly(garl_slot, npcs)
    except GarlError as error:
        stop(request.node, error)
    landing = Landing(garl_slot, result, run.record(garl_slot))
    verdict = result["verdict"]
    request.node.user_properties += [
        ("garl.slot", garl_slot.name),
        ("garl.outcome", result["outcome"]),
        ("garl.signature", verdict["signature"]),
        ("garl.story", verdict["story"]),
        ("garl.final_distance_m", result["final_distance_m"]),
        ("garl.elapsed_s", result["elapsed_s"]),
        ("garl.trajectory_sha256", run.trajectory_sha256(garl_slot)),
    ]
    if reasons := run.unproven(garl_slot):
        request.node.user_properties.append(("garl.unproven", "; ".join(reasons)))
    first = run.first_item(garl_slot) == request.node.nodeid
    if result["outcome"] == "inconclusive":
        pytest.skip(f"inconclusive: {result['undecided']}")
    if result["outcome"] == "crashed" and not first:
        pytest.skip(f"not decided: {verdict['story']}")
    if verdict["primary"] == "abort" and not first:
        pytest.skip("not decided: the landing was aborted")
    return landing


@pytest.fixture
def scenario(request: pytest.FixtureRequest, garl_slot: Target) -> Scenario:
    """Return the scenario that the slot holds."""
    run = request.config.stash[RUN]
    request.getfixturevalue("landing")
    scenario: Scenario = run.scenario(garl_slot)
    return scenario
