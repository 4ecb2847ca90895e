"""Searches, cases, baselines and comparisons with programs as landing systems."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.external.programs import CLIENTS
from tests.plugin.test_resume import FLOWN, query, wait_for
from tests.support.landing_project import result_hash, run
from tests.support.warm_python import COLD

LANDER = """
import sys, threading, time
import cv2
from pymavlink import mavutil

link = mavutil.mavlink_connection("udp:0.0.0.0:14550")
link.wait_heartbeat()
threading.Thread(target=lambda: [link.recv_match(blocking=True) for _ in range(99)]).start()
print("marker", sys.argv[1], int(cv2.VideoCapture(0).read()[1].sum()))
time.sleep(0.5)
link.set_mode("LAND")
"""
NODE = """
import time
import garl_client

link = garl_client.Link()
for seen in link:
    time.sleep(0.05)
    link.land(speed_mps=0.6, diagnostics={"phase": "lands", "note": str(bytes(seen.image)[:9])})
"""
SYSTEMS = """
import sys
from pytest_garl import Airframe, Camera, CompanionProgram, ExternalProgram

camera = Camera(width_px=64, height_px=48)
lander = CompanionProgram("python lander/lander.py {marker_id}", camera=camera)
node = ExternalProgram(
    [sys.executable, "node.py"], folder="node", airframe=Airframe(camera=camera)
)
"""
TESTS = """
import pytest
from systems import lander, node

HOVER = {"mode": "hover", "height_m": 2.0}
KNOWN = {"maps": ["lawn"], "start": HOVER, "limits": {"time_s": 3.0, "distance_m": 99.0}}

@pytest.mark.garl(system=lander, **KNOWN)
def test_lander(landing):
    assert landing.time_to_landing_s <= landing.limits.time_s

@pytest.mark.garl(system=node, **KNOWN)
def test_node(landing):
    assert landing.time_to_landing_s <= landing.limits.time_s
"""
PROGRAMS = ("lander", "node")
SEARCH = ("--garl-shrink=0", "-o", "garl_probes=never", "--garl-population=2", "test_it.py")


@pytest.fixture
def project(pytester: pytest.Pytester) -> Path:
    pytest.importorskip("pymavlink")
    pytester.makepyfile(systems=SYSTEMS, test_it=TESTS)
    pytester.makeini("[pytest]\n")
    for name, text in (("lander", LANDER), ("node", NODE)):
        (pytester.mkdir(name) / f"{name}.py").write_text(text)
    shutil.copy(CLIENTS / "garl_client.py", pytester.path / "node")
    return pytester.path


def garl(folder: Path, *words: str) -> str:
    return output(folder, "-c", "from pytest_garl.cli import main; main()", *words)


def output(folder: Path, *words: str) -> str:
    done = subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout + done.stderr


@pytest.mark.long
@pytest.mark.parametrize("name", PROGRAMS)
def test_a_killed_run_of_two_workers_resumes_to_the_bytes_of_one(
    pytester: pytest.Pytester, project: Path, name: str
) -> None:
    ledger = project / ".garl" / "ledger.sqlite"
    search = ("--garl-budget=4", "-k", name, *SEARCH)
    assert run(pytester, *search, "--garl-workers=1").ret in (0, 1)
    undisturbed = result_hash(pytester)
    assert query(ledger, f"SELECT count(*) {FLOWN} AND system = 'systems:{name}'") == [(4,)]
    shutil.rmtree(ledger.parent)
    process = subprocess.Popen(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *search, "--garl-workers=2"],
        cwd=project,
        env={**os.environ, **COLD, "PYTHONPATH": os.pathsep.join(sys.path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    wait_for(ledger, 1, process, patience_s=120.0)
    process.send_signal(signal.SIGKILL)
    process.communicate(timeout=60)
    assert query(ledger, f"SELECT count(*) {FLOWN}") < [(4,)]
    resumed = run(pytester, *search, "--garl-workers=2", "--garl-resume")
    assert resumed.ret in (0, 1)
    assert query(ledger, f"SELECT count(*) {FLOWN}") == [(4,)]
    assert result_hash(pytester) == undisturbed


@pytest.mark.long
def test_cases_baselines_and_comparisons_hold_in_another_folder(
    pytester: pytest.Pytester, project: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    run(pytester, "--garl-budget=1", "--garl-shrink=8", "-o", "garl_probes=never", "test_it.py")
    assert "saved base.json" in garl(
        project, "baseline", "save", "--from-ledger", ".garl/ledger.sqlite", "--out", "base.json"
    )
    cases = {each.read_text(): each for each in project.glob("scenarios/regressions/*/*.toml")}
    other = tmp_path_factory.mktemp("other") / "place"
    shutil.copytree(project, other, ignore=shutil.ignore_patterns(".garl"))
    assert " cases, 0 problems" in garl(other, "cases", "check")
    for name in PROGRAMS:
        text = next(each for each in cases if f'system = "systems:{name}"' in each)
        assert f'test = "test_it.py::test_{name}"' in text
        assert str(project) not in text
        said = garl(other, "cases", "replay", str(cases[text].relative_to(project)))
        assert "FAILED\nlate" in said
        assert "the same flight to the byte" in said
    assert str(project) not in (other / "base.json").read_text()
    changed = other / "lander" / "lander.py"
    changed.write_text(changed.read_text().replace("sleep(0.5)", "sleep(0.7)"))
    gate = output(other, "-m", "pytest", "-p", "no:cacheprovider", "--garl-baseline=base.json")
    assert gate.count("gate passed\n    1 pairs compared") == 2
    (lander, node) = re.findall("1 pairs compared, (.) of them the same flight to the byte", gate)
    assert (lander, node) == ("0", "1")
    systems = [word for name in PROGRAMS for word in ("--system", f"systems:{name}")]
    options = ("--maps=lawn", "--count=1", "--time-s=9", *systems)
    compared = garl(project, "diff", str(project), str(other), *options)
    assert compared.count("gate passed") == 2
    assert "1 pairs compared" in compared


@pytest.mark.ray
@pytest.mark.skipif(importlib.util.find_spec("ray") is None, reason="needs pytest-garl[ray]")
def test_ray_flies_programs_to_the_bytes_of_this_machine(
    pytester: pytest.Pytester, project: Path
) -> None:
    hashes = []
    for pool in ("ray", "local"):
        run(pytester, "--garl-budget=2", *SEARCH, "-o", f"garl_pool={pool}", "--garl-workers=2")
        hashes.append(result_hash(pytester))
        shutil.rmtree(project / ".garl")
    assert hashes[0] == hashes[1]
