"""Runs of pytest whose directors learn: the same bytes for any number of workers, and after a kill.

``tests/search/test_learned_search.py`` has the same of a landing that is computed, in seconds.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from pytest_garl.execution.ledger import Ledger
from pytest_garl.npcs.director_progress import AND_EVENTS
from pytest_garl.npcs.event_lessons import rule_network
from pytest_garl.process_tree import children_of
from tests.plugin.test_resume import FLOWN, query
from tests.search.learned_search import DOMAIN
from tests.support.warm_python import COLD

SYSTEM = """
import math
from pytest_garl import Land, PositionSetpoint, VelocitySetpoint

class Sinks:
    # A jump of its position matters as long as it is higher than 5 m.
    needs_camera = False

    def reset(self, mission):
        self.goal = mission.gps_position_m

    def step(self, observation):
        x, y, z = observation.position_m
        if z < 5 and math.dist((x, y), self.goal) < 3:
            return Land() if z < 0.5 else VelocitySetpoint(velocity_mps=(0.0, 0.0, -0.8))
        if math.dist((x, y), self.goal) < 0.4:
            return PositionSetpoint(position_m=(*self.goal, z - 1.0), speed_mps=0.7)
        return PositionSetpoint(position_m=(*self.goal, 10.0))
"""
TEST = """
import pytest
from systems import Sinks
pytestmark = pytest.mark.garl(system=Sinks, maps=["lawn"], domain="events.toml", start="hover")

def test_lands_on_the_marker(landing):
    assert landing.distance_to_landing_m <= 0.75
"""
FLIGHTS, SIZE = 24, 6
SEARCH = (
    f"--garl-budget={FLIGHTS}",
    f"--garl-population={SIZE}",
    "--garl-seed=3",
    "--garl-shrink=0",
)
"""With this seed it learns from the control that an event hurts earlier than the rule says."""
PATIENCE_S = 300


def write_project(folder: Path) -> None:
    folder.mkdir()
    (folder / "systems.py").write_text(SYSTEM)
    (folder / "test_it.py").write_text(TEST)
    (folder / "events.toml").write_text(DOMAIN.replace("from_s = [0, 8]", "from_s = [0, 2]"))
    (folder / "pytest.ini").write_text("[pytest]\n")


def start(folder: Path, *options: str) -> subprocess.Popen[bytes]:
    with (folder / "output.txt").open("ab") as output:
        return subprocess.Popen(
            [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *SEARCH, *options],
            cwd=folder,
            # Cold, because the workers of a warm run are not its children.
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), **COLD},
            stdout=output,
            stderr=subprocess.STDOUT,
        )


def run(folder: Path, *options: str) -> None:
    status = start(folder, *options).wait(PATIENCE_S)
    assert status in (0, 1), (folder / "output.txt").read_text()


def flown(folder: Path) -> int:
    found = query(folder / ".garl" / "ledger.sqlite", f"SELECT count(*) {FLOWN}")
    return found[0][0] if found else 0


@dataclass(frozen=True, kw_only=True)
class Learned:
    """What a run left: the hash of its results, and the weights of each generation."""

    results: str
    weights: tuple[str, ...]


def learned(folder: Path) -> Learned:
    ledger = Ledger(folder / ".garl" / "ledger.sqlite")
    try:
        ((search, _),) = ledger.searches()
        generations = range(FLIGHTS // SIZE)
        return Learned(
            results=ledger.queries.result_hash(),
            weights=tuple(ledger.facts.director(search, each) for each in generations),
        )
    finally:
        ledger.close()


@pytest.mark.long
def test_results_and_weights_of_both_directors_are_the_same(tmp_path: Path) -> None:
    folders = {name: tmp_path / name for name in ("one", "two", "killed")}
    for folder in folders.values():
        write_project(folder)
    run(folders["one"], "--garl-workers=1")
    run(folders["two"], "--garl-workers=2")
    for number, least in enumerate((2, SIZE + 2, 2 * SIZE + 2)):
        resume = ("--garl-resume",) if number else ()
        process = start(folders["killed"], "--garl-workers=2", *resume)
        ends_s = time.monotonic() + PATIENCE_S
        while process.poll() is None and flown(folders["killed"]) < least:
            assert time.monotonic() < ends_s
            time.sleep(0.05)
        assert process.poll() is None, "it ended before it was killed"
        # pytest, then what it left: workers, the process that learns.
        for pid in (process.pid, *children_of(process.pid)):
            os.kill(pid, signal.SIGKILL)
        process.wait(PATIENCE_S)
        assert flown(folders["killed"]) < FLIGHTS
    run(folders["killed"], "--garl-workers=1", "--garl-resume")
    first = learned(folders["one"])
    control, *others = first.weights
    assert control == ""
    assert all(text.partition(AND_EVENTS)[0] for text in others)
    events = {text.partition(AND_EVENTS)[2] for text in others}
    assert rule_network().text not in events, "it learned when events should strike"
    assert len(events) > 1
    assert learned(folders["two"]) == first
    assert learned(folders["killed"]) == first
