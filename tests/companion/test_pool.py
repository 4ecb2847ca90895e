"""Companion programs in searches: the same bytes for any number of workers, and contained."""

from __future__ import annotations

import pytest

from tests.companion.test_companion_flight import HEADER
from tests.support.landing_project import result_hash, run

pytestmark = pytest.mark.long
TEST = """
import pytest
from pytest_garl import Camera, CompanionProgram

lander = CompanionProgram("python lander.py {marker_id}", camera=Camera(width_px=64, height_px=48))
pytestmark = pytest.mark.garl(
    system=lander, maps=["lawn"], start={"mode": "hover", "height_m": 2.0}
)

def test_lands(landing):
    assert landing.time_to_landing_s <= 60
"""
LANDS = f"""{HEADER}
import threading
threading.Thread(target=lambda: [link.recv_match(blocking=True) for _ in range(100)]).start()
import cv2
cv2.VideoCapture(0).read()
time.sleep(0.5)
link.set_mode("LAND")
"""


def project(pytester: pytest.Pytester, text: str) -> None:
    (pytester.path / "lander.py").write_text(text)
    (pytester.path / "test_it.py").write_text(TEST)


def test_one_worker_and_two_record_the_same_bytes(pytester: pytest.Pytester) -> None:
    project(pytester, LANDS)
    hashes = []
    for workers in (1, 2):
        result = run(pytester, "--garl-budget=4", f"--garl-workers={workers}", "-q")
        assert "error" not in result.parseoutcomes()
        hashes.append(result_hash(pytester))
    assert hashes[0] == hashes[1]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("while True: pass", "*computes without waiting for anything, at File*lander.py*, line 1*"),
        ("import os, signal\nos.kill(os.getppid(), signal.SIGKILL)", "*"),
    ],
    ids=["hangs", "kills its parent"],
)
def test_a_program_that_hangs_or_kills_its_parent_does_not_end_the_run(
    pytester: pytest.Pytester, text: str, said: str
) -> None:
    project(pytester, text)
    result = run(
        pytester, "--garl-budget=2", "--garl-workers=1", "--garl-timeout=1", "-p", "no:randomly"
    )
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines([said, "*2 flights*"])
