"""Flights on Ray give the same results as in the local pool, also after a process is killed."""

from __future__ import annotations

import importlib.util
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.plugin.test_resume import (
    BUDGET,
    FLOWN,
    alive,
    children_of,
    query,
    slow_project,
    start,
    wait_for,
)
from tests.support.case_project import cases, saved
from tests.support.landing_project import CONFTEST, project, result_hash, run, write_project

needs_ray = [
    pytest.mark.ray,
    pytest.mark.skipif(importlib.util.find_spec("ray") is None, reason="needs pytest-garl[ray]"),
]
WITH_RAY = ("-o", "garl_pool=ray", "-o", "garl_workers=")
PATIENCE_S = 120.0
"""Ray starts slowly on a busy machine."""
BROKEN = """
import pytest
from systems import Exits, Raises, Sleeps

@pytest.mark.garl(system=Exits, maps=["lawn"])
def test_exits(landing): pass

@pytest.mark.garl(system=Raises, maps=["lawn"])
def test_raises(landing): pass

@pytest.mark.garl(system=Sleeps, maps=["lawn"])
def test_sleeps(landing): pass
"""


@pytest.fixture
def short_folder() -> Iterator[Path]:
    """Return a folder whose path is short enough for Ray's sockets."""
    folder = Path(tempfile.mkdtemp(prefix="ray-", dir="/tmp"))
    yield folder
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(scope="module")
def ray_cluster() -> Iterator[tuple[int, dict[str, str]]]:
    """Start a Ray cluster before pytest; return its process id and the environment to find it."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    token = {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": "0" * 64}
    folder = Path(tempfile.mkdtemp(prefix="ray-", dir="/tmp"))
    command = [sys.executable, "-m", "ray.scripts.scripts", "start", "--head", "--block"]
    command += [f"--port={port}", "--num-cpus=2", f"--object-store-memory={2**27}"]
    command += ["--include-dashboard=false", "--disable-usage-stats", f"--temp-dir={folder}"]
    with (folder / "output.txt").open("w") as output:
        process = subprocess.Popen(
            command, env={**os.environ, **token}, stdout=output, stderr=subprocess.STDOUT
        )
    try:
        while "Ray runtime started" not in (folder / "output.txt").read_text():
            assert process.poll() is None, (folder / "output.txt").read_text()
            time.sleep(0.1)
        yield process.pid, {**token, "RAY_ADDRESS": f"127.0.0.1:{port}"}
    finally:
        process.terminate()
        process.wait(PATIENCE_S)
        shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture
def cluster(ray_cluster: tuple[int, dict[str, str]], monkeypatch: pytest.MonkeyPatch) -> int:
    """Let sessions find the cluster; return its process id."""
    pid, environment = ray_cluster
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    return pid


def descendants_of(pid: int) -> list[int]:
    """Return the ids of a process's children, their children and so on."""
    children = children_of(pid)
    return children + [each for child in children for each in descendants_of(child)]


def flight_actors(pids: list[int]) -> list[int]:
    """Return the ids of the processes that are Ray actors which fly."""
    found = []
    for pid in pids:
        try:
            command = Path(f"/proc/{pid}/cmdline").read_bytes()
        except OSError:
            continue
        if command.startswith(b"ray::FlightActor"):
            found.append(pid)
    return found


@pytest.fixture(scope="module")
def undisturbed() -> dict[str, str]:
    """Return a place for the result hash of the local pool, set by the first test that needs it."""
    return {}


def slow_hash(pytester: pytest.Pytester, undisturbed: dict[str, str]) -> str:
    if not undisturbed:
        run(pytester, *BUDGET)
        undisturbed["hash"] = result_hash(pytester)
        shutil.rmtree(pytester.path / ".garl")
    return undisturbed["hash"]


class TestOnACluster:
    pytestmark = needs_ray

    def test_ray_pool_finds_and_saves_the_same_as_the_local_pool(
        self, pytester: pytest.Pytester, cluster: int
    ) -> None:
        project(pytester)
        search = ("--garl-budget=24", "--garl-shrink=24")
        run(pytester, *search, "--garl-workers=1")
        local, files = result_hash(pytester), saved(pytester)
        flights = sorted(path.name for path in (pytester.path / ".garl" / "flights").iterdir())
        assert cases(pytester)
        shutil.rmtree(pytester.path / "scenarios")
        shutil.rmtree(pytester.path / ".garl")
        result = run(pytester, *search, *WITH_RAY)
        result.stdout.fnmatch_lines(["garl: budget 24*all workers of Ray at 127.0.0.1:*"])
        assert (result_hash(pytester), saved(pytester)) == (local, files)
        kept = sorted(path.name for path in (pytester.path / ".garl" / "flights").iterdir())
        assert kept == flights

    def test_xdist_and_ray_fly_together(
        self, pytester: pytest.Pytester, cluster: int, undisturbed: dict[str, str]
    ) -> None:
        slow_project(pytester)
        expected = slow_hash(pytester, undisturbed)
        result = run(pytester, *BUDGET, *WITH_RAY, "-n2")
        assert result.ret in (0, 1)
        assert result_hash(pytester) == expected

    def test_broken_system_is_the_same_finding_as_in_the_local_pool(
        self, pytester: pytest.Pytester, cluster: int
    ) -> None:
        project(pytester)
        pytester.makepyfile(test_it=BROKEN)
        search = ("--garl-budget=2", "--garl-timeout=0.5", "--garl-workers=2")
        run(pytester, *search)
        local = result_hash(pytester)
        result = run(pytester, *search, *WITH_RAY)
        result.stdout.fnmatch_lines(["*exit status 3*", "*one call took longer than 1.5 s*"])
        assert result_hash(pytester) == local

    @pytest.mark.parametrize("victim", ["worker", "driver"])
    def test_killed_processes_lose_no_flight(
        self, pytester: pytest.Pytester, cluster: int, undisturbed: dict[str, str], victim: str
    ) -> None:
        slow_project(pytester)
        expected = slow_hash(pytester, undisturbed)
        ledger = pytester.path / ".garl" / "ledger.sqlite"
        process = start(pytester, *WITH_RAY)
        wait_for(ledger, 5, process, PATIENCE_S)
        workers = [pid for (pid,) in query(ledger, "SELECT pid FROM worker")]
        pids = workers if victim == "driver" else flight_actors(descendants_of(cluster))
        os.kill(random.Random(victim).choice(pids), signal.SIGKILL)
        output, _ = process.communicate(timeout=PATIENCE_S)
        assert process.returncode in (0, 1), output
        assert query(ledger, f"SELECT count(*) {FLOWN}") == [(30,)]
        # A process that Ray lost is no crash of the landing system: no flight is flown alone again.
        assert query(ledger, "SELECT value FROM meter WHERE name = 'retried'") == []
        assert result_hash(pytester) == expected


class TestOnAClusterOfItsOwn:
    pytestmark = needs_ray

    @pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL])
    def test_interrupted_run_leaves_nothing_and_resumes_on_any_pool(
        self,
        pytester: pytest.Pytester,
        monkeypatch: pytest.MonkeyPatch,
        short_folder: Path,
        undisturbed: dict[str, str],
        end: signal.Signals,
    ) -> None:
        slow_project(pytester)
        expected = slow_hash(pytester, undisturbed)
        monkeypatch.delenv("RAY_ADDRESS", raising=False)
        monkeypatch.setenv("RAY_TMPDIR", str(short_folder))
        ledger = pytester.path / ".garl" / "ledger.sqlite"
        process = start(pytester, *WITH_RAY)
        wait_for(ledger, 5, process, PATIENCE_S)
        started = descendants_of(process.pid)
        assert len(flight_actors(started)) == 2
        process.send_signal(end)
        output, _ = process.communicate(timeout=PATIENCE_S)
        assert "2 workers of Ray, started here" in output
        for _ in range(200):
            if not any(alive(pid) for pid in started) and not list(short_folder.iterdir()):
                break
            time.sleep(0.1)
        assert not any(alive(pid) for pid in started), "orphaned processes"
        assert not list(short_folder.iterdir()), "files left behind"
        assert 5 <= query(ledger, f"SELECT count(*) {FLOWN}")[0][0] < 30
        assert run(pytester, *BUDGET, "--garl-resume").ret in (0, 1)
        assert query(ledger, f"SELECT count(*) {FLOWN}") == [(30,)]
        assert result_hash(pytester) == expected


def test_error_without_ray_says_how_to_install_it(pytester: pytest.Pytester) -> None:
    write_project(pytester.path)
    hidden = (
        "import importlib.util\n"
        "find = importlib.util.find_spec\n"
        "importlib.util.find_spec = lambda name, *of: None if name == 'ray' else find(name, *of)\n"
    )
    pytester.makeconftest(hidden + CONFTEST)
    result = run(pytester, "--garl-budget=8", *WITH_RAY)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*Ray is not installed; pip install 'pytest-garl[[]ray[]]'*"])
    assert not (pytester.path / ".garl").exists()


@pytest.mark.ray
@pytest.mark.skipif(importlib.util.find_spec("ray") is None, reason="needs pytest-garl[ray]")
def test_missing_cluster_is_one_clear_error(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    project(pytester)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
        monkeypatch.setenv("RAY_ADDRESS", address)
        result = run(pytester, "--garl-budget=8", *WITH_RAY)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"*RAY_ADDRESS={address}: nobody answers there*"])
    assert not (pytester.path / ".garl").exists()


def test_worker_of_ray_is_never_the_pytest_process(pytester: pytest.Pytester) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=8", "--garl-workers=0", *WITH_RAY)
    result.stderr.fnmatch_lines(["*--garl-workers: found '0', expected a whole number*least 1*"])
