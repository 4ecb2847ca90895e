"""What the judge says reaches the tests of a search."""

from __future__ import annotations

import pytest

from tests.support.landing_project import project, run

TOUCHES_AND_GIVES_UP = """
import dataclasses

import tiny_simulator
from pytest_garl.simulation.flight import Contact
from pytest_garl.simulation.flight_file import hash_of


def fly(*args, **options):
    flight = tiny_simulator.fly(*args, **options)
    touch = Contact(
        time_s=14.2,
        body="ground",
        kind="ground",
        body_class="ground",
        position_m=(0.0, 0.0, 0.0),
        speed_mps=0.5,
        tilt_rad=0.0,
    )
    changed = dataclasses.replace(flight, outcome="aborted", contacts=(touch,), crash=None)
    return dataclasses.replace(changed, sha256=hash_of(changed))
"""


def test_touching_the_ground_off_the_marker_before_an_abort_fails_the_search(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    pytester.makepyfile(gives_up=TOUCHES_AND_GIVES_UP)
    conftest = pytester.path / "conftest.py"
    conftest.write_text(conftest.read_text().replace("tiny_simulator", "gives_up"))
    # In fog it comes down 3 m off the marker.
    result = run(pytester, "--garl-budget=6", "--garl-workers=0", "--garl-weather=full")
    outcomes = result.parseoutcomes()
    assert outcomes["failed"] == 1
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["*Touched the ground 3.0 m off the marker before it gave up*"])
    result.stdout.fnmatch_lines(["* I[?]:unknown * pytest test_it.py --garl-repeat=lawn-g*"])
    result.stdout.fnmatch_lines(["FAILED test_it.py::test_distance*"])
