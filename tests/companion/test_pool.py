"""Companion programs in searches: the same bytes for any number of workers, and contained."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pytest_garl.errors import LandingSystemError
from pytest_garl.execution.local_pool import temporary_pool
from pytest_garl.execution.on_demand import fly_all
from pytest_garl.execution.reference import BUILT_IN
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.task import Start
from pytest_garl.testing import check_landing_system
from tests.companion.misbehaving import FINDINGS, NONDETERMINISTIC, PROGRAMS, left_running
from tests.execution.flying import LAWN, job_of, scenario
from tests.support.landing_project import run

pytestmark = pytest.mark.long
CALM = scenario().without(*(name for name, _ in LAWN.present_objects))
HOVER = dataclasses.replace(
    CALM, task=dataclasses.replace(CALM.task, start=Start(mode="hover", height_m=2.0))
)
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


def project(pytester: pytest.Pytester, text: str) -> None:
    (pytester.path / "lander.py").write_text(text)
    (pytester.path / "test_it.py").write_text(TEST)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("while True: pass", "*lander is starting up, at File*lander.py*, line 1*"),
        (
            "import time\ntime.sleep(1)\nwhile True: pass",
            "*lander computes without waiting for anything, at File*lander.py*, line 3*",
        ),
    ],
)
def test_the_report_of_a_program_that_hangs_has_its_line(
    pytester: pytest.Pytester, text: str, said: str
) -> None:
    project(pytester, text)
    result = run(
        pytester, "--garl-budget=2", "--garl-workers=1", "--garl-timeout=4", "-p", "no:randomly"
    )
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines([said, "*2 flights*"])


def test_nothing_that_programs_do_ends_the_run_or_outlives_it(tmp_path: Path) -> None:
    shared = Path("/dev/shm")
    before = {*shared.iterdir()} if shared.is_dir() else set()
    found, hashes = {}, set()
    with temporary_pool(1) as both:
        for name, program in PROGRAMS.items():
            job = dataclasses.replace(
                job_of(program, tmp_path, timeout_s=5.0),
                simulator=BUILT_IN,
                npcs=policy_spec("stationary"),
            )
            (done,) = fly_all(*both, job, [HOVER])
            assert left_running() == []
            if name in FINDINGS:
                found[name] = done.signature
            else:
                assert done.result.crash is None, name
                hashes.add(done.sha256)
    assert found == FINDINGS
    assert len(hashes) == 1
    # Nodes of ROS 2 and pools of processes that run beside the tests have files of their own there.
    left = {each for each in shared.glob("*") if not each.name.startswith(("fastdds", "sem.mp-"))}
    assert left - before == set()


@pytest.mark.parametrize("name", NONDETERMINISTIC)
def test_a_program_that_flies_otherwise_each_time_is_named(name: str) -> None:
    program, start = NONDETERMINISTIC[name], Start(mode="hover", height_m=2.0)
    differs = f"{name}: two flights of the same scenario differ, first at .* s; if that is intended"
    with pytest.raises(LandingSystemError, match=differs):
        check_landing_system(program, start=start, seconds=2.0)
    check = check_landing_system(program, start=start, seconds=2.0, deterministic=False)
    assert any(f"{name}: two flights of the same scenario" in each for each in check.warnings)
