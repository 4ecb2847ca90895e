"""The header for C++, and the program of the docs that flies by it."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from pytest_garl.external.external_program import ExternalProgram
from pytest_garl.npcs.domain_policy import domain_with_policy
from pytest_garl.scenarios.task import DEFAULT_TASK
from pytest_garl.search.probes import clear_scenario
from pytest_garl.simulation.fly import fly
from tests.external.programs import CLIENTS, at_once, flown
from tests.support.flights import LAWN, STAND

COMPILER = shutil.which("g++")
pytestmark = pytest.mark.skipif(COMPILER is None, reason="there is no g++")
EXAMPLE = Path(__file__).parents[2] / "docs" / "your-stack" / "lander.cpp"
ALL_FIELDS = r"""
#include "garl.hpp"
#include <cstdio>
struct Comma : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
};
int main(int count, char** words) {
  std::locale::global(std::locale(std::locale(), new Comma));
  garl::Link link("NED", {"rangefinder_m"});
  std::printf("not for stdout\n");
  while (auto seen = link.next()) {
    garl::Diagnostics said;
    said.phase = "a \"phase\" with \\ and \n";
    said.target_m = garl::Vec3{1.5, -2.25, 0};
    said.detections.push_back({7, 0.5, {1e-7, 0.1, -3}, {{1, 2}, {3, 4}}});
    auto [x, y, z] = link.mission.home_m;
    if (count > 1) link.position({x, y, 0.0 / (z - z)});
    else if (seen->frame == 0) link.velocity({0, 0, -1}, 0.5, said);
    else if (seen->frame == 1) link.attitude({0, 0, 0, 1}, 0.7, said);
    else if (seen->frame == 2) link.position({x, y, -2}, 1.5, said, {0.1, 2.0, 0.3});
    else if (seen->frame == 3) link.land(0.7, said);
    else link.abort(said);
  }
  (void)words;
}
"""


def compiled(source: Path, folder: Path) -> Path:
    target = folder / "lander"
    options = ["-std=c++17", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror", f"-I{CLIENTS}"]
    subprocess.run([COMPILER or "", *options, source, "-o", target], check=True)
    return target


def test_the_program_of_the_docs_lands(tmp_path: Path) -> None:
    compiled(EXAMPLE, tmp_path)
    scenario = clear_scenario(LAWN, DEFAULT_TASK, domain_with_policy("field", tmp_path))
    program = ExternalProgram(["./lander"], folder=tmp_path)
    flight = fly(scenario, program, STAND, map=LAWN)
    assert (flight.outcome, flight.crash) == ("landed", None)
    assert flight.final_distance_m < 0.3


def test_each_command_arrives_with_all_its_fields(tmp_path: Path) -> None:
    """In NED, in a locale with another decimal point; what it prints is no answer."""
    (tmp_path / "all.cpp").write_text(ALL_FIELDS)
    compiled(tmp_path / "all.cpp", tmp_path)
    flight = flown(ExternalProgram(["./lander"], folder=tmp_path, airframe=at_once()))
    assert flight.crash is None
    velocity, attitude, position, land, *_ = flight.steps
    assert (velocity.command, attitude.command) == ("VelocitySetpoint", "AttitudeSetpoint")
    assert position.diagnostics is not None
    assert position.diagnostics.phase == 'a "phase" with \\ and \n'
    assert position.diagnostics.target_m == (-2.25, 1.5, 0.0)
    (seen,) = position.diagnostics.detections
    assert (seen.marker_id, seen.position_m) == (7, (0.1, 1e-7, 3.0))
    assert seen.corners_px == ((1.0, 2.0), (3.0, 4.0))
    assert land.command == "Land"
    crash = flown(ExternalProgram(["./lander", "nan"], folder=tmp_path, name="bad")).crash
    assert crash is not None
    assert (crash.kind, crash.error) == ("nonsense", "BadCommand")
    assert "nan" in crash.message
