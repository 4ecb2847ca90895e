"""What a build server does when a job is cancelled, to the commands that fly."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pytest_garl.cases.corpus import Corpus
from pytest_garl.process_tree import any_command_contains
from tests.support.broken_lander import case_of_broken_lander

SLOW = """
import time

class Lander:
    def reset(self, mission):
        time.sleep(5)

    def step(self, observation):
        raise ZeroDivisionError("no plan")
"""
PATIENCE_S = 120.0


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_cancelled_command_leaves_no_folder_and_no_process(tmp_path: Path, number: int) -> None:
    project, scratch = tmp_path / "project", tmp_path / "scratch"
    scratch.mkdir()
    (project / "stack_of_test").mkdir(parents=True)
    (project / "stack_of_test" / "__init__.py").write_text(SLOW)
    file = Corpus(project / "scenarios").save(case_of_broken_lander())
    assert file
    start = "from pytest_garl.cli import main; main()"
    command = [sys.executable, "-c", start, "cases", "shrink", str(file), "--workers=1"]
    environment = {**os.environ, "TMPDIR": str(scratch), "PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(
        command, cwd=project, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    ) as process:
        until = time.monotonic() + PATIENCE_S
        while not list(scratch.glob("garl-*/ledger.sqlite")) and time.monotonic() < until:
            assert process.poll() is None, process.communicate()[0]
            time.sleep(0.02)
        process.send_signal(number)
        output = process.communicate(timeout=PATIENCE_S)[0].decode()
    assert process.returncode == (143 if number == signal.SIGTERM else 1), output
    assert list(scratch.glob("garl-*")) == []
    while any_command_contains(str(scratch)) and time.monotonic() < until:
        time.sleep(0.02)
    assert not any_command_contains(str(scratch))
