"""Systems that are not here: what macOS and Windows lack is taken from a run's interpreters."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.support.landing_project import write_project
from tests.support.warm_python import COLD

SUPPORT = Path(__file__).with_name("support") / "other_systems"
SEARCH = ("--garl-budget=8", "--garl-workers=2", "--garl-shrink=0", "--garl-population=4")
LANDER = Path(__file__).parents[1] / "docs" / "your-stack" / "mavlink_lander.py"
FLIES_A_PROGRAM = """
import sys

from pytest_garl import CompanionProgram
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.search.probes import clear_scenario
from pytest_garl.npcs.domain_policy import domain_with_policy
from pytest_garl.scenarios.task import Start, Task
from pytest_garl.simulation.fly import fly

lander = CompanionProgram(
    f"{sys.executable} mavlink_lander.py --marker {{marker_id}} --north {{north_m}} "
    "--east {east_m} --altitude {search_altitude_m} --focal {focal_px} "
    "--dictionary {marker_dictionary}",
)
map = load_map("lawn")
task = Task(marker=map.marker, start=Start())
scenario = clear_scenario(map, task, domain_with_policy("calm", "."))
flight = fly(scenario, lander, policy_spec("stationary"), map=map)
print(flight.outcome, flight.touchdown)
"""


def start(system: str, folder: Path, *command: str, **more: str) -> subprocess.Popen[str]:
    """Start Python in a folder as if on another system; there is none called linux."""
    environment = {
        **os.environ,
        **COLD,
        **more,
        "PYTHONPATH": os.pathsep.join([str(SUPPORT / system), str(Path(__file__).parents[1])]),
    }
    return subprocess.Popen(
        [sys.executable, *command],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )


def run(system: str, folder: Path, *command: str) -> tuple[int, str]:
    process = start(system, folder, *command)
    output, _ = process.communicate(timeout=120)
    return process.returncode, output


def pytest_in(system: str, folder: Path, *args: str) -> tuple[int, str]:
    return run(system, folder, "-m", "pytest", "-p", "no:cacheprovider", *args)


def test_stand_in_for_macos_lacks_what_macos_lacks(tmp_path: Path) -> None:
    code = (
        "import ctypes, os, signal, pathlib\n"
        "assert not hasattr(signal, 'SIGRTMAX') and not hasattr(os, 'memfd_create')\n"
        "assert not hasattr(ctypes.CDLL(None), 'prctl') and hasattr(ctypes.CDLL(None), 'getpid')\n"
        "assert not pathlib.Path('/proc/self/stat').exists()\n"
        "assert not list(pathlib.Path('/proc').glob('*'))\n"
    )
    assert run("macos", tmp_path, "-c", code) == (0, "")


@pytest.mark.parametrize("lander", ["Good", pytest.param("Exits", marks=pytest.mark.long)])
def test_search_on_macos_finds_what_it_finds_on_linux(lander: str, tmp_path: Path) -> None:
    results = set()
    for system in ("linux", "macos"):
        folder = tmp_path / system
        folder.mkdir()
        write_project(folder, lander)
        status, output = pytest_in(system, folder, *SEARCH)
        assert status == 1, output
        results |= set(re.findall(r"results [0-9a-f]{16}", output))
    assert len(results) == 1


def test_companion_program_flies_on_macos_as_on_linux(tmp_path: Path) -> None:
    pytest.importorskip("pymavlink")
    shutil.copy(LANDER, tmp_path)
    (tmp_path / "flies.py").write_text(FLIES_A_PROGRAM)
    flown = [run(system, tmp_path, "flies.py") for system in ("linux", "macos")]
    assert flown[0][0] == 0, flown[0][1]
    assert flown[0][1].startswith("landed ")
    assert flown[0] == flown[1]


def test_call_that_hangs_is_found_on_macos_with_its_stack(tmp_path: Path) -> None:
    write_project(tmp_path, "Sleeps")
    found, output = pytest_in("macos", tmp_path, *SEARCH, "--garl-budget=1", "--garl-timeout=0.5")
    assert found == 1, output
    # By the signal that stands in for that of Linux the process tells where it was.
    assert re.search(r"systems\.py\", line \d+ in step", output)


def test_workers_end_on_macos_when_pytest_is_killed(tmp_path: Path) -> None:
    write_project(tmp_path, "Good")
    text = (tmp_path / "systems.py").read_text()
    (tmp_path / "systems.py").write_text(text.replace("return Land()", "time.sleep(1)", 1))
    process = start(
        "macos", tmp_path, "-m", "pytest", *SEARCH, "--garl-timeout=60", GARL_MARK=str(tmp_path)
    )

    def ours() -> set[int]:
        found = set()
        for file in Path("/proc").glob("[0-9]*/environ"):
            with contextlib.suppress(OSError):
                if f"GARL_MARK={tmp_path}".encode() in file.read_bytes():
                    found.add(int(file.parent.name))
        return found

    try:
        until = time.monotonic() + 60
        while len(ours()) < 5 and time.monotonic() < until:
            time.sleep(0.1)
        # pytest, two supervisors and their flying processes.
        assert len(ours()) >= 5
        process.kill()
        process.communicate(timeout=30)
        until = time.monotonic() + 30
        while ours() and time.monotonic() < until:
            time.sleep(0.1)
        assert ours() == set()
    finally:
        for pid in ours():
            with contextlib.suppress(OSError):
                os.kill(pid, signal.SIGKILL)


def test_windows_runs_pytest_and_collects_but_does_not_fly(tmp_path: Path) -> None:
    write_project(tmp_path, "Good")
    (tmp_path / "test_other.py").write_text("def test_other(): pass\n")
    found, output = pytest_in("windows", tmp_path)
    assert found == 0, output
    assert "1 passed" in output
    found, output = pytest_in("windows", tmp_path, "--garl-budget=4")
    assert found == pytest.ExitCode.USAGE_ERROR, output
    assert "\n" not in output.strip()
    assert "cannot fly: pytest-garl needs Linux or macOS; on Windows install it in WSL" in output


@pytest.mark.parametrize("command", [["check", "test_it.py"], ["cases", "list"], ["init"]])
def test_windows_has_one_line_for_each_command(command: list[str], tmp_path: Path) -> None:
    write_project(tmp_path, "Good")
    code = "from pytest_garl.cli import main; main()"
    found, output = run("windows", tmp_path, "-c", code, *command)
    assert found == 1
    assert "\n" not in output.strip()
    assert "cannot fly" in output
