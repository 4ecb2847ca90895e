"""What a run survives: kill -9 of any of its processes, Ctrl-C, a second run beside it."""

from __future__ import annotations

import json
import os
import random
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from pytest_garl.npcs.learned import Network, save
from pytest_garl.npcs.weights import WEIGHTS
from tests.support.landing_project import project, result_hash, run
from tests.support.warm_python import COLD

SLOW = """
import time
from pytest_garl import Land

class Slow:
    def reset(self, mission): time.sleep(0.03)
    def step(self, observation): return Land()
"""
FLOWN = "FROM slot JOIN search ON search.id = slot.search WHERE kind = 'search' AND state = 'flown'"
"""Flights of the search; a violation that was flown once more is none of its budget."""
BUDGET = (
    "--garl-budget=30",
    "--garl-shrink=0",
    "--garl-population=6",
    "--garl-workers=2",
    "--garl-map=lawn",
)


def slow_project(pytester: pytest.Pytester) -> None:
    project(pytester, "Slow", "['lawn']")
    pytester.makepyfile(systems=SLOW)


def start(
    pytester: pytest.Pytester, *args: str, environment: Mapping[str, str] | None = None
) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *BUDGET, *args]
    return subprocess.Popen(
        command,
        cwd=pytester.path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), **(environment or {})},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def query(path: Path, sql: str) -> list[tuple[int, ...]]:
    """Read the ledger from outside; nothing while there is none."""
    if not path.exists():
        return []
    database = sqlite3.connect(f"file:{path}?mode=ro", uri=True, timeout=10)
    try:
        return database.execute(sql).fetchall()
    except sqlite3.Error:
        return []
    finally:
        database.close()


def wait_for(
    path: Path, flights: int, process: subprocess.Popen[str], patience_s: float = 30.0
) -> None:
    for _ in range(int(100 * patience_s)):
        done = query(path, f"SELECT count(*) {FLOWN}")
        if process.poll() is not None or (done and done[0][0] >= flights):
            return
        time.sleep(0.01)
    raise AssertionError(f"nothing was flown in {patience_s:g} s")


def children_of(pid: int) -> list[int]:
    found = []
    for folder in Path("/proc").iterdir():
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if folder.name.isdigit() and int(fields[1]) == pid:
            found.append(int(folder.name))
    return found


def alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


@pytest.fixture(scope="module")
def undisturbed() -> dict[str, str]:
    """Return the hash of the run that nobody disturbed, made by the first test."""
    return {}


MOMENTS = [
    pytest.param(moment, marks=[] if moment % 16 == 0 else [pytest.mark.long])
    for moment in range(20)
]


@pytest.mark.parametrize("moment", MOMENTS)
def test_killed_run_resumes_with_the_same_results(
    pytester: pytest.Pytester, undisturbed: dict[str, str], moment: int
) -> None:
    slow_project(pytester)
    ledger = pytester.path / ".garl" / "ledger.sqlite"
    if not undisturbed:
        run(pytester, *BUDGET)
        undisturbed["hash"] = result_hash(pytester)
        assert query(ledger, f"SELECT count(*) {FLOWN}") == [(30,)]
    victim = ("pytest", "worker", "xdist worker")[moment % 3]
    rng = random.Random(moment)
    parallel = ["-n2"] if victim == "xdist worker" else []
    # Cold, because the workers of a warm run of xdist are not its children.
    process = start(pytester, *parallel, environment=COLD)
    wait_for(ledger, rng.randrange(28), process)
    time.sleep(rng.uniform(0, 0.1))
    workers = [pid for (pid,) in query(ledger, "SELECT pid FROM worker")]
    pids = {
        "pytest": [process.pid],
        "worker": workers,
        "xdist worker": children_of(process.pid),
    }[victim]
    if pids and process.poll() is None:
        os.kill(rng.choice(pids), signal.SIGKILL)
    # A worker that is killed does not end the run: its slot is flown once more.
    process.communicate(timeout=60)
    for _ in range(200):
        if not any(alive(pid) for pid in workers):
            break
        time.sleep(0.05)
    assert not any(alive(pid) for pid in workers), "orphans"
    before = query(ledger, f"SELECT generation, slot, sha256 {FLOWN}")
    resumed = run(pytester, *BUDGET, "--garl-resume")
    assert resumed.ret in (0, 1)
    after = query(ledger, f"SELECT generation, slot, sha256 {FLOWN}")
    assert len(after) == 30
    assert set(before) <= set(after)
    assert query(ledger, "SELECT CAST(value AS INT) FROM meter WHERE name = 'flights'") == [(30,)]
    assert result_hash(pytester) == undisturbed["hash"]


def test_ctrl_c_leaves_no_orphan_and_a_ledger_that_resumes(pytester: pytest.Pytester) -> None:
    slow_project(pytester)
    ledger = pytester.path / ".garl" / "ledger.sqlite"
    process = start(pytester)
    wait_for(ledger, 5, process)
    workers = [pid for (pid,) in query(ledger, "SELECT pid FROM worker")]
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == pytest.ExitCode.INTERRUPTED, output
    assert "of 30 flown; the same command with --garl-resume goes on" in output
    assert workers
    assert not any(alive(pid) for pid in workers)
    resumed = run(pytester, *BUDGET, "--garl-resume")
    assert resumed.ret in (0, 1)
    resumed.stdout.fnmatch_lines(["garl: resuming after * flights; budget 30*"])
    assert query(ledger, f"SELECT count(*) {FLOWN}") == [(30,)]


def test_second_run_in_the_same_folder_is_refused(pytester: pytest.Pytester) -> None:
    slow_project(pytester)
    # So slow that the first run goes on until the second has ended.
    pytester.makepyfile(systems=SLOW.replace("0.03", "2"))
    process = start(pytester)
    wait_for(pytester.path / ".garl" / "ledger.sqlite", 1, process)
    second = run(pytester, *BUDGET)
    assert second.ret == pytest.ExitCode.USAGE_ERROR
    second.stderr.fnmatch_lines([f"*another run is using this folder (process {process.pid})*"])
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode == pytest.ExitCode.INTERRUPTED


def test_resume_refuses_another_search_and_a_changed_system(pytester: pytest.Pytester) -> None:
    slow_project(pytester)
    search = ("--garl-budget=2", "--garl-workers=0")
    run(pytester, *search)
    before = result_hash(pytester)

    def is_refused(words: str, *options: str) -> None:
        result = run(pytester, *search, "--garl-resume", *options)
        assert result.ret == pytest.ExitCode.USAGE_ERROR
        result.stderr.fnmatch_lines([words])
        assert result_hash(pytester) == before

    is_refused("*seed was 0, is 1*", "--garl-seed=1")
    is_refused("*method was garl, is random*", "--garl-method=random")
    is_refused("*domain was paper, is calm*", "--garl-domain=calm")
    pytester.makepyfile(systems=SLOW.replace("0.03", "0.04"))
    is_refused("*Slow on lawn is not what it was: systems.py changed*")


@pytest.fixture
def composed(pytester: pytest.Pytester) -> pytest.Pytester:
    """Search with a system of two modules and a folder of data, and with weights in a file."""
    slow_project(pytester)
    pytester.makepyfile(systems=f"import helper\n{SLOW}", helper="speed = 1")
    model = pytester.mkdir("model")
    (model / "net.bin").write_bytes(b"weights")
    marked = (pytester.path / "test_it.py").read_text()
    marker = "maps=['lawn'], files=['model'])"
    (pytester.path / "test_it.py").write_text(marked.replace("maps=['lawn'])", marker))
    weigh(pytester.path / "policy.npz", 1.0)
    run(pytester, *COMPOSED)
    return pytester


COMPOSED = ("--garl-budget=2", "--garl-workers=0", "--garl-npcs=policy.npz")


def weigh(path: Path, scale: float) -> None:
    """Write weights as `garl train` does: the shipped ones, scaled."""
    with np.load(WEIGHTS / "dqn.npz") as shipped:
        layers = tuple(
            (shipped[f"weight_{n}"] * scale, shipped[f"bias_{n}"]) for n in range(len(shipped) // 2)
        )
    state = json.loads((WEIGHTS / "dqn.json").read_text())["state"]
    save(path, Network(state=state, layers=layers), {})


@pytest.mark.parametrize(
    ("file", "text"), [("helper.py", b"speed = 2"), ("model/net.bin", b"other weights")]
)
def test_resume_refuses_changed_modules_and_data_of_a_system(
    composed: pytest.Pytester, file: str, text: bytes
) -> None:
    assert run(composed, *COMPOSED, "--garl-resume").ret in (0, 1)
    before = result_hash(composed)
    (composed.path / file).write_bytes(text)
    result = run(composed, *COMPOSED, "--garl-resume")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"*Slow on lawn is not what it was: {file} changed*"])
    assert result_hash(composed) == before


def test_resume_names_changed_weights_of_the_policy(composed: pytest.Pytester) -> None:
    weigh(composed.path / "policy.npz", 2.0)
    result = run(composed, *COMPOSED, "--garl-resume")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*is not what it was: the weights policy.npz changed*"])


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ("['gone.bin']", "*mark.garl: files: there is no 'gone.bin' below *"),
        ("'net.bin'", "*mark.garl: files='net.bin': expected a list of paths*"),
    ],
)
def test_missing_data_file_is_an_error(pytester: pytest.Pytester, files: str, words: str) -> None:
    slow_project(pytester)
    marked = (pytester.path / "test_it.py").read_text()
    (pytester.path / "test_it.py").write_text(
        marked.replace("maps=['lawn'])", f"maps=['lawn'], files={files})")
    )
    result = run(pytester, "--garl-budget=1", "--garl-workers=1")
    result.stdout.fnmatch_lines([words])
    assert result.ret == pytest.ExitCode.INTERRUPTED


@pytest.mark.parametrize("budget", [1, 7, 19, pytest.param(60, marks=pytest.mark.long)])
def test_budget_counts_flights_exactly(pytester: pytest.Pytester, budget: int) -> None:
    project(pytester)
    run(pytester, f"--garl-budget={budget}", "--garl-workers=0")
    ledger = pytester.path / ".garl" / "ledger.sqlite"
    counted = query(ledger, f"SELECT count(*), count(DISTINCT scenario) {FLOWN}")
    assert counted == [(budget, budget)]


@pytest.mark.parametrize("parallel", [(), pytest.param(("-n2",), marks=pytest.mark.long)])
def test_full_disk_ends_the_run_with_one_clear_error(
    pytester: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    """A limit on the size of files stands for the full disk."""
    slow_project(pytester)
    limited = "ulimit -f 400; exec " + " ".join(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *BUDGET, *parallel]
    )
    done = subprocess.run(
        ["bash", "-c", limited],
        cwd=pytester.path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode not in (0, 1), done.stdout
    assert "is there space" in done.stdout + done.stderr
    assert "Traceback" not in done.stdout
    ledger = pytester.path / ".garl" / "ledger.sqlite"
    flown = query(ledger, f"SELECT count(*) {FLOWN}")[0][0]
    assert 0 < flown < 30
    assert run(pytester, *BUDGET, "--garl-resume").ret in (0, 1)
    assert query(ledger, f"SELECT count(*) {FLOWN}") == [(30,)]
