from __future__ import annotations

import platform
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from pytest_garl import Start, testing
from pytest_garl.cli import main
from pytest_garl.cli.check_command import _planned
from pytest_garl.testing import Check, CheckPlan, ProbeResult

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


class Other(Climbs):
    pass
"""
TESTS = """
import pytest
from pytest_garl import MarkerSpec, Start, limits
from checked_stack import Climbs, Other

HOVER = Start(mode="hover", height_m=5.0)


class TestClimbs:
    pytestmark = pytest.mark.garl(system=Climbs, maps=["court", "lawn"], domain="calm")

    def test_lands(self, landing):
        assert False

    def test_lands_in_time(self, landing):
        assert False


@pytest.mark.garl(system=Other, maps=["lawn"], start=HOVER, limits=limits(time_s=3, abort="ok"))
def test_other(landing):
    assert False


def test_without_flights():
    assert False
"""
GIVES_UP = """
import pytest
from checked_stack import Climbs
from pytest_garl import Abort, Start

class GivesUp(Climbs):
    def step(self, observation):
        return Abort()

@pytest.mark.garl(system=GivesUp, maps=["lawn"], start=Start(mode="hover", height_m=5.0))
def test_gives_up(landing):
    assert False
"""


@pytest.fixture(autouse=True)
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    for name in ("checked_stack", "test_checked"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    (tmp_path / "checked_stack.py").write_text(SYSTEM)
    (tmp_path / "heavy_stack.py").write_text(
        "from pytest_garl import Airframe\nAIRFRAME = Airframe(mass_kg=-1)\n"
    )
    (tmp_path / "broken_stack.py").write_text("1 / 0\n")
    (tmp_path / "test_checked.py").write_text(TESTS)
    (tmp_path / "test_unknown_module.py").write_text("import no_such_module\n")
    (tmp_path / "pytest.ini").write_text("[pytest]\naddopts = -q\n")


def garl(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["check", *arguments])


def test_check_prints_its_observations_and_exits_with_zero() -> None:
    done = garl("checked_stack:Climbs", "--seconds=2", "--map=lawn", "--map=court")
    assert done.exit_code == 0, done.output
    assert "Climbs: lawn: cut off" in done.output
    assert "Climbs: court: cut off" in done.output
    # The same on both maps is one warning.
    assert done.output.count("warning: returns no diagnostics") == 1


def test_check_exits_with_one_if_a_system_does_not_land(tmp_path: Path) -> None:
    (tmp_path / "test_gives_up.py").write_text(GIVES_UP)
    done = garl("test_gives_up.py")
    assert done.exit_code == 1
    assert "fault: your system does not land in clear air, on lawn" in done.output


def test_check_takes_systems_and_maps_from_the_tests_of_a_file_and_runs_none() -> None:
    done = garl("test_checked.py", "--seconds=1")
    assert done.exit_code == 0, done.output
    lines = [line for line in done.output.splitlines() if ": cut off" in line]
    flown = [line.partition(": cut off")[0] for line in lines]
    assert flown == [
        "Climbs: court",
        "Climbs: court, another scenario",
        "Climbs: lawn",
        "Climbs: lawn, another scenario",
        "Other: lawn",
        "Other: lawn, another scenario",
    ]
    assert "5.0 s the UAV" not in done.output


def test_check_takes_the_task_of_one_test() -> None:
    (system, plan), *others = _planned("test_checked.py::test_other", ())
    assert not others
    assert system.__name__ == "Other"
    assert plan.task.start == Start(mode="hover", height_m=5.0)
    assert (plan.limits.time_s, plan.limits.abort) == (3, "ok")
    assert plan.domain.name == "field"
    (_, first), (_, second) = _planned("test_checked.py::TestClimbs", ())
    assert first.domain.name == "calm"
    assert (first.map.name, second.map.name) == ("court", "lawn")
    ((_, selected),) = _planned("test_checked.py::TestClimbs::test_lands", ("lawn",))
    assert selected == second


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ("test_checked.py::test_without_flights", "found no landing test; expected one that takes"),
        ("test_checked.py::test_missing", "test_missing"),
        ("test_missing.py", "file or directory not found: test_missing.py"),
        ("test_unknown_module.py", f"this is Python {platform.python_version()}"),
        ("test_unknown_module.py", "No module named 'no_such_module'"),
    ],
)
def test_check_says_why_a_file_has_nothing_to_fly(target: str, words: str) -> None:
    done = garl(target)
    assert done.exit_code == 1
    assert words in done.output
    assert "INTERNALERROR" not in done.output


def test_check_flies_the_probes_of_a_landing_system_on_one_map(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    flown: list[tuple[str, str, bool]] = []

    def record(system: type, plan: CheckPlan) -> Check:
        flown.append((system.__name__, plan.map.name, plan.probes))
        failed = ProbeResult(name="no-marker", sentence="none", ending="landed", violated=True)
        probes = (failed,) if plan.probes else ()
        return Check(system="S", flights=(), warnings=(), cpu_s=0.0, probes=probes)

    monkeypatch.setattr(testing, "check_as_planned", record)
    assert garl("test_checked.py").exit_code == 1
    # The court has a marker of its own on the ground.
    wanted = [("Climbs", "court", False), ("Climbs", "lawn", True), ("Other", "lawn", True)]
    assert flown == wanted
    flown.clear()
    assert garl("test_checked.py", "--no-probes").exit_code == 0
    assert not any(probes for _, _, probes in flown)


def test_check_flies_on_no_map_that_the_tests_do_not_name() -> None:
    done = garl("test_checked.py::test_other", "--map=court")
    assert done.exit_code == 1
    assert "its tests do not fly on court" in done.output


@pytest.mark.parametrize(
    ("system", "words"),
    [
        ("checked_stack:Backwards", "speed_mps = -1; expected 0 to 100 m/s"),
        ("checked_stack:Big", "Big.airframe is 'big'"),
        ("checked_stack:Nothing", "has no attribute 'Nothing'"),
        ("checked_stack", "expected MODULE:CLASS"),
        ("no_stack:Climbs", "No module named 'no_stack'"),
        ("no_stack:Climbs", f"this is Python {platform.python_version()} at {sys.executable}"),
        ("heavy_stack:Climbs", "Airframe.mass_kg = -1; expected a number from 0.1 to 100 kg"),
        ("broken_stack:Climbs", "cannot be imported as a landing system (ZeroDivisionError"),
    ],
)
def test_check_reports_a_fault_as_one_error(system: str, words: str) -> None:
    done = garl(system, "--seconds=2")
    assert done.exit_code == 1
    assert words in done.output
    assert "Traceback" not in done.output


EXITS = """
import os
from checked_stack import Climbs

class Exits(Climbs):
    def step(self, observation):
        os._exit(0)
"""


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ("exits:Exits", "Exits: tried to end this process, with status 0"),
        ("gone:Gone", "gone:Gone: tried to end this process, with status 0"),
        ("test_gone.py", "test_gone.py: tried to end this process, with status 0"),
    ],
)
def test_check_is_not_ended_by_what_it_checks(tmp_path: Path, target: str, words: str) -> None:
    (tmp_path / "exits.py").write_text(EXITS)
    (tmp_path / "gone.py").write_text("import os\nos._exit(0)\n")
    (tmp_path / "test_gone.py").write_text("import gone\n")
    garl_file = str(Path(sys.executable).with_name("garl"))
    command = [garl_file, "check", target, "--seconds=2"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert words in done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="Linux tells with what a process was started")
def test_it_starts_with_the_environment_of_flights(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("GLIBC_TUNABLES", "_PYTEST_GARL_RESTARTED"):
        monkeypatch.delenv(name, raising=False)
    Path("tells.py").write_text(
        "from pathlib import Path\nprint(Path('/proc/self/environ').read_text().split('\\0'))\n"
    )
    command = [str(Path(sys.executable).with_name("garl")), "check", "tells:Nothing"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "'GLIBC_TUNABLES=glibc.malloc.hugetlb=1'" in done.stdout
