"""Tests whose UAV holds its place, from the marker to the summary, with the real simulator."""

from __future__ import annotations

import pytest

from tests.support.landing_project import run

pytestmark = pytest.mark.sim
SYSTEMS = '''
from pytest_garl import Diagnostics, Land

class Base:
    needs_camera = False
    def reset(self, mission): self.mission = mission

class Plans(Base):
    """Knows where the marker is told to be, and plans straight down."""
    def step(self, observation):
        (x, y), height = self.mission.gps_position_m, self.mission.search_altitude_m
        said = Diagnostics(target_m=(x, y, 0.0), planned_path_m=((x, y, height), (x, y, 0.5)))
        return Land(diagnostics=said)

class Looks(Plans):
    needs_camera = True

class Aims(Base):
    """Takes the place where it hovers for the marker, and has no plan."""
    def step(self, observation):
        x, y, _ = self.mission.home_m
        return Land(diagnostics=Diagnostics(target_m=(x, y, 0.0)))

class Silent(Base):
    def step(self, observation): return Land()

class Watches(Base):
    needs_camera = True
    def step(self, observation):
        assert observation.image is not None
        return Land()

class Raises(Base):
    def step(self, observation): raise RuntimeError("the terminal point is in an obstacle")
'''
TESTS = """
import pytest
from pytest_garl import MarkerSpec, Start
from systems import *
pytestmark = pytest.mark.garl(
    system={system}, maps=["lawn"], marker=MarkerSpec(id=3, side_m=0.75),
    start=Start(mode="hold", height_m=5.0),
)

def test_distance(landing):
    assert landing.distance_to_landing_m <= landing.limits.distance_m

def test_time(landing):
    assert landing.time_to_landing_s <= landing.limits.time_s

def test_collisions(landing):
    assert not landing.collisions

def test_completes(landing):
    assert landing.completed or landing.excused
"""
SCENARIO = """
schema = 2
map = "lawn"
seed = 1
[scenario.marker]
x_m = {x_m}
y_m = 0.0
{more}
[task.marker]
dictionary = "DICT_5X5_50"
id = 3
side_m = 0.75
[task.start]
mode = "hold"
height_m = 5.0
"""
DOG = """
[scenario.dog-1]
start_x_m = 0.2
start_y_m = 0.0
speed_mps = 0.0
grade = "careless"
"""


COVERED = """
[scenario.cover]
from_s = 0.0
lasts_s = 60.0
share_percent = 100.0
"""


def flown(
    pytester: pytest.Pytester, system: str, more: str = "", x_m: float = 0.0
) -> pytest.RunResult:
    """Return a run whose tests fly one scenario."""
    pytester.makepyfile(systems=SYSTEMS, test_it=TESTS.format(system=system))
    (pytester.path / "one.toml").write_text(SCENARIO.format(x_m=x_m, more=more))
    return run(pytester, "--garl-repeat=one.toml", "-v", "-p", "no:randomly")


def test_a_plan_down_to_the_marker_passes(pytester: pytest.Pytester) -> None:
    flown(pytester, "Plans").assert_outcomes(passed=4)


def test_a_plan_through_a_dog_fails_the_test_of_collisions(pytester: pytest.Pytester) -> None:
    """The mission is not completed, which the test of collisions shows already."""
    result = flown(pytester, "Looks", DOG)
    result.assert_outcomes(passed=2, failed=1, skipped=1)
    result.stdout.fnmatch_lines(["*test_collisions*FAILED*", "*IV:dog:plan*"])
    result.stdout.fnmatch_lines(["*its plans led through dog-1*"])


def test_a_target_off_the_marker_fails_the_test_of_distance(pytester: pytest.Pytester) -> None:
    result = flown(pytester, "Aims", x_m=3.0)
    result.stdout.fnmatch_lines(["*test_distance*FAILED*", "*I:nothing:hold*"])
    result.stdout.fnmatch_lines(["*test_collisions*SKIPPED*not judged: the UAV h*"])


def test_a_system_that_reports_nothing_is_not_green(pytester: pytest.Pytester) -> None:
    result = flown(pytester, "Silent")
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["*nothing that can be judged*Diagnostics(planned_path_m=*"])
    assert "passed" not in result.parseoutcomes()


def test_a_system_is_silent_while_the_marker_cannot_be_read(pytester: pytest.Pytester) -> None:
    result = flown(pytester, "Watches", COVERED)
    result.stdout.fnmatch_lines(["*test_distance*SKIPPED (not judged: the UAV*"])
    assert "inconclusive" not in result.stdout.str()


def test_a_planner_that_raises_fails(pytester: pytest.Pytester) -> None:
    result = flown(pytester, "Raises")
    assert result.parseoutcomes()["failed"] == 1
    result.stdout.fnmatch_lines(["*V:RuntimeError@*"])


def test_a_search_tells_that_its_flights_held_their_place(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(systems=SYSTEMS, test_it=TESTS.format(system="Plans"))
    result = run(pytester, "--garl-budget=2", "--garl-population=2", "-o", "garl_domain=calm")
    result.stdout.fnmatch_lines(["*held its place in 2 flights: no landing, its plans are judged*"])
    assert "landed in none" not in result.stdout.str()


def test_a_search_of_silent_flights_says_what_to_report(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(systems=SYSTEMS, test_it=TESTS.format(system="Silent"))
    result = run(pytester, "--garl-budget=2", "--garl-population=2", "-o", "garl_domain=calm")
    text = " ".join(result.stdout.str().split())
    assert "at most 0 may be: lawn-g00-s00, lawn-g00-s01. The UAV held its place" in text
    assert "sends LANDING_TARGET" in text
    assert "--garl-timeout" not in text


def test_probes_hide_the_marker_half_way_through_the_hold(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(systems=SYSTEMS, test_it=TESTS.format(system="Plans"))
    words = "--garl-budget=2", "--garl-population=2", "-o", "garl_probes=always", "-rA"
    text = run(pytester, *words, "-o", "garl_domain=calm").stdout.str()
    assert "from 15.0 s on, 4.8 m up, the marker is gone for a minute" in text
    assert "the marker lies 2 m west of the start" in text
