from __future__ import annotations

import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from pytest_garl.cli import main

SYSTEM = """
from pytest_garl import PositionSetpoint

class Climbs:
    needs_camera = False

    def reset(self, mission):
        self.x, self.y, _ = mission.home_m

    def step(self, observation):
        return PositionSetpoint(position_m=(self.x, self.y, 3.0))


class Backwards(Climbs):
    def step(self, observation):
        return PositionSetpoint(position_m=(self.x, self.y, 3.0), speed_mps=-1)


class Big(Climbs):
    airframe = "big"
"""


@pytest.fixture(autouse=True)
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "checked_stack.py").write_text(SYSTEM)
    (tmp_path / "heavy_stack.py").write_text(
        "from pytest_garl import Airframe\nAIRFRAME = Airframe(mass_kg=-1)\n"
    )
    (tmp_path / "broken_stack.py").write_text("1 / 0\n")


def garl(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["check", *arguments])


def test_check_prints_its_observations_and_exits_with_zero() -> None:
    done = garl("checked_stack:Climbs", "--seconds=2", "--map=lawn", "--map=court")
    assert done.exit_code == 0, done.output
    assert "Climbs: lawn: Not landed" in done.output
    assert "Climbs: court: Not landed" in done.output
    assert "warning: returns no diagnostics" in done.output


@pytest.mark.parametrize(
    ("system", "words"),
    [
        ("checked_stack:Backwards", "speed_mps = -1; expected 0 to 100 m/s"),
        ("checked_stack:Big", "Big.airframe is 'big'"),
        ("checked_stack:Nothing", "has no attribute 'Nothing'"),
        ("checked_stack", "expected MODULE:CLASS"),
        ("no_stack:Climbs", "No module named 'no_stack'"),
        ("heavy_stack:Climbs", "Airframe.mass_kg = -1; expected a number from 0.1 to 100 kg"),
        ("broken_stack:Climbs", "cannot be imported as a landing system (ZeroDivisionError"),
    ],
)
def test_check_reports_a_fault_as_one_error(system: str, words: str) -> None:
    done = garl(system, "--seconds=2")
    assert done.exit_code == 1
    assert words in done.output
    assert "Traceback" not in done.output
