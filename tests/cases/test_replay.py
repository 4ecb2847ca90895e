"""A case is replayed with its moves and with its changes of the environment."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from pathlib import Path

import pytest

from pytest_garl.cases.case import Case
from pytest_garl.cases.case_file import dump_case
from pytest_garl.cases.case_test_run import CaseTestResult
from pytest_garl.cases.replay import (
    Replay,
    SourceHashes,
    _by_tests,
    replay,
    stale_reasons,
)
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.flight.flight_file import save
from pytest_garl.shrinking.case_flights import recorded_behaviour
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from tests.cases.samples import case
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


ENDS_ITS_PROCESS = """
from pathlib import Path
from pytest_garl.cases.case_file import load_case
from pytest_garl.cases.replay import replay
print(replay(load_case(Path("case.toml")), Path()).result)
"""


@pytest.mark.sim
def test_a_system_that_ends_the_process_is_not_fixed(tmp_path: Path) -> None:
    plain = dataclasses.replace(case(), system="lander:Lander", test="")
    (tmp_path / "case.toml").write_text(dump_case(plain))
    (tmp_path / "lander.py").write_text(
        "import os\n"
        "class Lander:\n"
        "    needs_camera = False\n"
        "    def reset(self, mission): os._exit(0)\n"
        "    def step(self, observation): ...\n"
    )
    command = [sys.executable, "-c", ENDS_ITS_PROCESS]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "lander:Lander: tried to end this process, with status 0" in done.stderr


CASE = case()
SOURCES = SourceHashes.of(CASE.evidence)


def test_pass_after_a_change_of_the_landing_system_is_not_stale() -> None:
    repaired = dataclasses.replace(SOURCES, system_sha256="00" * 32)
    assert stale_reasons(CASE, repaired, "another flight") == ()


def test_identical_flight_is_stale() -> None:
    (reason,) = stale_reasons(CASE, SOURCES, CASE.evidence.trajectory_sha256)
    assert reason.startswith("the flight is the recorded one to the byte")


def test_other_flight_with_the_same_sources_is_stale() -> None:
    (reason,) = stale_reasons(CASE, SOURCES, "another flight")
    assert "neither the landing system nor the simulator has changed" in reason


def test_changes_of_map_and_simulator_are_both_named() -> None:
    changed = dataclasses.replace(SOURCES, map_sha256="", simulator_sha256="")
    assert stale_reasons(CASE, changed, "another flight") == (
        "the map 'lawn' has changed",
        "the simulator has changed",
    )


def replayed(outcome: str, excuse: str = "", signature: str = "") -> Replay:
    """Return the replay of a case whose test passed in a flight that was judged as given."""
    properties = {"garl.outcome": outcome, "garl.excuse": excuse, "garl.signature": signature}
    passed = CaseTestResult(nodeid="t.test", outcome="passed", message="", properties=properties)
    return _by_tests(CASE, LAWN, (passed,), passed, Path("none"), live=False)


@pytest.mark.parametrize("outcome", ["gave_up", "not_landed"])
def test_excused_flight_proves_no_repair(outcome: str) -> None:
    excused = replayed(outcome, excuse="readable for 0.4 s.")
    assert excused.result == "UNDECIDED"
    assert excused.reasons == (
        "nobody could have landed, so it proves no repair: readable for 0.4 s.",
    )


def test_needless_giving_up_is_no_repair() -> None:
    assert replayed("gave_up", signature="II:gave-up-in-sight:search").result == "FAILED"
    assert replayed("gave_up").result == "FIXED"
