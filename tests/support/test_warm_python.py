"""Processes that tests start warm behave as others."""

from __future__ import annotations

import subprocess
import sys
import threading
from pathlib import Path

WAITS = """
import sys

def test_it():
    sys.stdin.read()
"""


def run_of_pytest(folder: Path, file: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "pytest", "-s", "-p", "no:cacheprovider", file]
    return subprocess.Popen(
        command, cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, bufsize=0
    )


def test_a_run_is_waited_for_while_another_thread_waits_for_a_longer_one(tmp_path: Path) -> None:
    (tmp_path / "test_waits.py").write_text(WAITS)
    with run_of_pytest(tmp_path, "test_waits.py") as longer:
        waits = threading.Thread(target=longer.wait)
        waits.start()
        with run_of_pytest(tmp_path, "test_missing.py") as shorter:
            also_waits = threading.Thread(target=shorter.wait)
            also_waits.start()
            also_waits.join(timeout=60)
            is_waited_for, goes_on = shorter.returncode, longer.returncode
            assert longer.stdin
            longer.stdin.close()
        waits.join()
    assert (is_waited_for, goes_on) == (4, None)
    assert longer.returncode == 0
