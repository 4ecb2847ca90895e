"""A project whose landing system raises as long as a file of it is there, and a case of that."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

import pytest

from pytest_garl.cases.case import Case, CaseEvidence, Violation
from pytest_garl.cases.corpus import Corpus
from pytest_garl.execution.reference import BUILT_IN, simulator_sha256
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.validity import repair
from pytest_garl.verdicts.verdict import Limits

SYSTEM = """
from pathlib import Path
from pytest_garl import Abort, PositionSetpoint

class Lander:
    def reset(self, mission):
        self.home = mission.home_m

    def step(self, observation):
        if Path("broken").exists():
            raise ZeroDivisionError("no plan")
        x, y, _ = self.home
        return Abort()
"""
TESTS = """
import pytest
from stack_of_test import Lander

@pytest.mark.garl(system=Lander, maps=["lawn"])
def test_lands(landing):
    assert landing.distance_to_landing_m <= landing.limits.distance_m
"""
LAWN = load_map("lawn")


def case_of_broken_lander() -> Case:
    """Return a case in which the lander raises at once, in fog that is not the cause."""
    genome = genome_for(LAWN)
    scenario = repair(decode(genome.nominal, genome, map="lawn", seed=3), LAWN)
    names = [name for name, _ in LAWN.present_objects]
    return Case(
        system="stack_of_test:Lander",
        status="open",
        live=True,
        scenario=scenario.replace({"environment.fog": 0.1}).without(*names[1:]),
        violation=Violation(
            signature="V:ZeroDivisionError@stack_of_test.step",
            type="V",
            property="crash",
            margin=0.0,
            unit="1",
            description="The landing system raised: ZeroDivisionError: no plan.",
        ),
        policy="stationary",
        policy_sha256="",
        moves=((names[0], ()),),
        evidence=CaseEvidence(
            trajectory_sha256="",
            cpu="",
            map_sha256=LAWN.sha256,
            neighbours=3,
            neighbours_failed=3,
            removed="nothing",
            versions=(("pytest-garl", version("pytest-garl")),),
            system_sha256="",
            simulator_sha256=simulator_sha256(BUILT_IN),
        ),
        # The repaired lander gives up at once.
        limits=Limits(abort="ok"),
    )


def broken_project(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Yield the case file of a project whose lander is broken, relative to the project."""
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "path", [*sys.path])
    (folder / "stack_of_test.py").write_text(SYSTEM)
    (folder / "test_lander.py").write_text(TESTS)
    (folder / "broken").touch()
    path = Corpus(folder / "scenarios" / "regressions").save(case_of_broken_lander())
    assert path is not None
    yield path.relative_to(folder)
    sys.modules.pop("stack_of_test", None)
