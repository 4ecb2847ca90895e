"""The code of docs/extending.md runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pytest_garl.scenarios.maps.loading import load_map

PAGE = Path(__file__).parents[2] / "docs" / "extending.md"
BLOCK = re.compile(r"^```(?:python|toml)\n# (\S+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
SYSTEM = """
from pytest_garl import Land, VelocitySetpoint

class MyLandingSystem:
    def reset(self, mission): pass
    def step(self, observation):
        if observation.time_s < 2.0:
            return VelocitySetpoint(velocity_mps=(0.0, 0.0, 2.0))
        return Land()
"""
TEST = """
import pytest
from my_landing import MyLandingSystem

pytestmark = pytest.mark.garl(system=MyLandingSystem, maps={maps})

def test_lands(landing):
    assert landing.distance_to_landing_m <= landing.limits.distance_m
"""

CHASED = """
import numpy as np
import pytest
from my_landing import MyLandingSystem

pytestmark = pytest.mark.garl(system=MyLandingSystem, maps=["helipad"])

def test_objects_go_to_the_uav(landing):
    uav = landing.flight.uav.position_m[0, :2]
    assert len(landing.flight.objects) == 3
    for each in landing.flight.objects:
        way = uav - each.track.position_m[0, :2]
        assert each.moves[0] @ way == pytest.approx(np.linalg.norm(way), rel=0.01)
"""


def write_page(folder: Path, *left_out: str) -> None:
    """Write the files of the page, the blocks of one file one after the other."""
    blocks = BLOCK.findall(PAGE.read_text())
    assert len(blocks) == len(re.findall(r"^```\w", PAGE.read_text(), re.MULTILINE)) == 8
    for name, code in blocks:
        if name not in left_out:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            with (folder / name).open("a") as file:
                file.write(code)
    (folder / "my_landing.py").write_text(SYSTEM)


def fly(pytester: pytest.Pytester, *options: str) -> pytest.RunResult:
    project = ("-p", "no:cacheprovider", "-o", "pythonpath=.")
    flying = ("--garl-workers=1", "--garl-shrink=0", *options)
    return pytester.runpytest_subprocess(*project, *flying)


def test_method_and_simulator_of_the_page_fly_together(pytester: pytest.Pytester) -> None:
    write_page(pytester.path, "test_my_property.py")
    pytester.makepyfile(test_landing=TEST.format(maps=["lawn"]))
    result = fly(pytester, "--garl-budget=3", "--garl-method=my_method:InFog")
    result.assert_outcomes(failed=1, xfailed=2, passed=1)
    result.stdout.fnmatch_lines(["*landed 3.0 m off the marker*"])


def test_property_of_the_page_fails_as_one_of_the_user(pytester: pytest.Pytester) -> None:
    write_page(pytester.path, "test_hypothesis.py")
    result = fly(pytester, "--garl-budget=3", "--garl-method=my_method:InFog")
    # The flights stay below 20 m and meet nobody; in fog each of them lands off the marker.
    # That also fails it to complete: one event, one failing test.
    result.assert_outcomes(failed=1, xfailed=2, passed=6, skipped=3)
    result.stdout.fnmatch_lines(["FAILED *::test_violates_nothing_in_fog*"])


def test_map_of_the_page_is_read(tmp_path: Path) -> None:
    write_page(tmp_path)
    map = load_map("helipad", (tmp_path / "scenarios" / "maps",))
    assert [name for name, _ in map.present_objects] == ["person-1", "person-2", "dog-1"]


@pytest.mark.sim
def test_policy_of_the_page_moves_objects_on_its_map(pytester: pytest.Pytester) -> None:
    write_page(pytester.path, "my_simulator.py", "test_hypothesis.py", "test_my_property.py")
    conftest = (pytester.path / "conftest.py").read_text()
    (pytester.path / "conftest.py").write_text(conftest.partition("import my_simulator")[0])
    pytester.makepyfile(test_landing=CHASED)
    # A scenario of the paper's world lacks none of the map's objects.
    fly(pytester, "--garl-budget=1", "--garl-domain=paper").assert_outcomes(passed=1)
