"""A case is replayed with its moves and with its changes of the environment."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pytest_garl.execution.result import CompletedFlight
from pytest_garl.regressions.case import Case
from pytest_garl.regressions.recorded_behaviour import recorded_behaviour
from pytest_garl.regressions.replay import replay
from pytest_garl.simulation.flight_file import save
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from tests.regressions.samples import case
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
def test_replay_is_identical_only_with_the_recorded_changes(recorded: Case, tmp_path: Path) -> None:
    assert replay(recorded, tmp_path).same_flight is True
    assert replay(dataclasses.replace(recorded, changes=()), tmp_path).same_flight is False
