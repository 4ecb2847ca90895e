"""Two mistakes of one landing system that end alike have two signatures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lab.faults.control import ControlSystem, Vector
from pytest_garl import Observation
from pytest_garl.commands import Command
from pytest_garl.flight.flight_file import load, save
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.files import loads
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import Limits

SCENARIO = """schema = 2
map = "lawn"
seed = 1
[scenario.marker]
x_m = 2.0
y_m = 1.0
"""
DIM = "[scenario.light]\nsun_elevation_deg = -1.0\nsun_azimuth_deg = 270.0\n"
SOUTH = "[scenario.heading]\nstart_deg = -90.0\n"


class TwoMistakes(ControlSystem):
    """Gives up in dim light, and if its nose points south."""

    wrong = False

    def step(self, observation: Observation) -> Command:
        """Notice what it cannot do."""
        x, y, z, w = observation.attitude
        yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        dim = float(np.mean(observation.image)) < 60
        self.wrong = bool(dim or abs(yaw + np.pi / 2) < 0.6)
        return super().step(observation)

    def land(self, now: float, at: Vector, target: tuple[float, float]) -> Command:
        """Give up."""
        return self.give_up() if self.wrong else super().land(now, at, target)


@pytest.mark.sim
def test_two_mistakes_that_end_alike_have_two_signatures(tmp_path: Path) -> None:
    verdicts = []
    for text in (DIM, SOUTH):
        scenario = loads(SCENARIO + text, load_map("lawn"))
        flight = fly(scenario, TwoMistakes, policy_spec("graded"))
        save(flight, tmp_path / "flight.npz")
        # A record says as much as the flight.
        verdicts.append(judge(load(tmp_path / "flight.npz"), Limits()))
    endings = {verdict.ending for verdict in verdicts}
    assert len(endings) == 1
    (ending,) = endings
    assert ending.startswith("II:gave-up-in-sight")
    assert [each.signature for each in verdicts] == [f"{ending}:light", f"{ending}:heading"]
