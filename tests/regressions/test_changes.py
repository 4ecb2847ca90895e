"""What a policy changed of the environment is flown again with its case."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.execution.result import CompletedFlight
from pytest_garl.plugin.search_setup import npc_policy_of
from pytest_garl.regressions.case import Case
from pytest_garl.regressions.recorded_behaviour import recorded_behaviour
from pytest_garl.regressions.replay import replay
from pytest_garl.simulation.flight_file import save
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from tests.regressions.samples import NAMES, case, case_with_changes
from tests.simulation.test_environment import LAWN, SCENARIO, WEATHERMAKER
from tests.support.results import flight_result


@pytest.fixture
def recorded(tmp_path: Path) -> Case:
    """Return a case of a flight during which the dog's policy let it snow."""
    flight = fly(SCENARIO, ReferencePilot, WEATHERMAKER, map=LAWN)
    save(flight, tmp_path / "flight.npz")
    done = CompletedFlight(
        result=flight_result(), sha256=flight.sha256, record=tmp_path / "flight.npz"
    )
    behaviour = recorded_behaviour(done, SCENARIO, LAWN)
    assert behaviour.changes
    plain = case()
    return dataclasses.replace(
        plain,
        system=f"{ReferencePilot.__module__}:{ReferencePilot.__qualname__}",
        scenario=SCENARIO,
        moves=behaviour.moves,
        changes=behaviour.changes,
        evidence=dataclasses.replace(
            plain.evidence, trajectory_sha256=flight.sha256, cpu=flight.cpu
        ),
    )


@pytest.mark.sim
def test_a_case_is_replayed_to_the_byte_only_with_its_changes(
    recorded: Case, tmp_path: Path
) -> None:
    assert replay(recorded, tmp_path).same_flight is True
    assert replay(dataclasses.replace(recorded, changes=()), tmp_path).same_flight is False


def test_pytest_flies_a_case_with_its_moves_and_its_changes() -> None:
    def arguments(each: Case) -> dict[str, Any]:
        target: Any = SimpleNamespace(case=each, live=False)
        return dict(npc_policy_of(target, policy_spec("greedy")).arguments)

    changes = json.loads(arguments(case_with_changes())["changes"])
    assert changes == {
        NAMES[-1]: [[0, "environment.fog", 0.01], [2, "environment.sun_position", -0.01]]
    }
    # So that the searches' keys of other cases stay what they were.
    assert arguments(case()).keys() == {"moves"}
