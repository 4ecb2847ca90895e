"""A search with a program: the same bytes for one worker, and for two after a kill."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.external.programs import CLIENTS
from tests.plugin.test_resume import FLOWN, query, wait_for
from tests.support.landing_project import project, result_hash, run
from tests.support.warm_python import COLD

LANDER = """
import time
import garl_client

link = garl_client.Link()
for seen in link:
    time.sleep(0.1)
    link.land(diagnostics={"phase": "lands", "target_m": [seen.position_m[0], 0.0, 0.0]})
"""
SYSTEM = """
import sys
from pytest_garl import ExternalProgram

lander = ExternalProgram([sys.executable, "-S", "lander.py"], folder="lander")
"""
BUDGET = ("--garl-budget=10", "--garl-shrink=0", "--garl-population=5")


def lander_project(pytester: pytest.Pytester) -> Path:
    project(pytester, "lander", "['lawn']")
    pytester.makepyfile(systems=SYSTEM)
    folder = pytester.mkdir("lander")
    (folder / "lander.py").write_text(LANDER)
    shutil.copy(CLIENTS / "garl_client.py", folder)
    return pytester.path / ".garl" / "ledger.sqlite"


@pytest.mark.long
def test_a_killed_run_of_two_workers_resumes_to_the_bytes_of_one(
    pytester: pytest.Pytester,
) -> None:
    ledger = lander_project(pytester)
    assert run(pytester, *BUDGET, "--garl-workers=1").ret in (0, 1)
    undisturbed = result_hash(pytester)
    assert query(ledger, f"SELECT count(*) {FLOWN} AND system = 'systems:lander'") == [(10,)]
    shutil.rmtree(pytester.path / ".garl")
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *BUDGET]
    process = subprocess.Popen(
        [*command, "--garl-workers=2"],
        cwd=pytester.path,
        env={**os.environ, **COLD, "PYTHONPATH": os.pathsep.join(sys.path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    wait_for(ledger, 3, process)
    process.send_signal(signal.SIGKILL)
    process.communicate(timeout=60)
    assert query(ledger, f"SELECT count(*) {FLOWN}") < [(10,)]
    resumed = run(pytester, *BUDGET, "--garl-workers=2", "--garl-resume")
    assert resumed.ret in (0, 1)
    assert query(ledger, f"SELECT count(*) {FLOWN}") == [(10,)]
    assert result_hash(pytester) == undisturbed
