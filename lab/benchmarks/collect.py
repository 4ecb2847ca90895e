"""The time that pytest needs to collect items: ``python -m lab.benchmarks.collect``.

It collects 7,200 items of a search (3 systems, 2 maps, budget 400, 3 tests) and 3,000 items of
1,000 saved cases, and nothing at all for comparison, because pytest counts its own start.
"""

from __future__ import annotations

import dataclasses
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from pytest_garl.cases.case import Case, CaseEvidence, Violation
from pytest_garl.cases.case_file import dump_case
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.verdicts.verdict import Limits

SYSTEM = """
class {name}:
    def reset(self, mission): ...
    def step(self, observation): ...
"""
TESTS = """
import pytest
from systems import {name}
pytestmark = pytest.mark.garl(system={name}, maps=["court", "lawn"])
def test_distance(landing): ...
def test_time(landing): ...
def test_collisions(landing): ...
"""
NAMES = ("First", "Second", "Third")
CASES = 1000


def case_of(seed: int) -> Case:
    """Return a case with all genes and a record of moves of 20 s for each object."""
    map = load_map("lawn")
    genome = genome_for(map)
    rng = np.random.default_rng(seed)
    moves = tuple((float(x), float(y)) for x, y in rng.uniform(-0.7, 0.7, (40, 2)))
    return Case(
        system=f"systems:{NAMES[0]}",
        status="open",
        live=True,
        scenario=decode(genome.random(rng), genome, map="lawn", seed=seed),
        violation=Violation(
            signature="IV:dog:descent:seen",
            type="IV",
            property="collision",
            margin=0.0,
            unit="m",
            description="A dog.",
        ),
        policy="dqn",
        policy_sha256="",
        moves=tuple((name, moves) for name, _ in map.present_objects),
        evidence=CaseEvidence(
            trajectory_sha256="",
            cpu="",
            map_sha256=map.sha256,
            neighbours=3,
            neighbours_failed=3,
            removed="nothing",
            versions=(),
            system_sha256="",
            simulator_sha256="",
        ),
        limits=Limits(),
    )


def collected(folder: str, *options: str) -> str:
    """Return pytest's own last line."""
    command = [sys.executable, "-m", "pytest", "-q", "--collect-only", *options]
    done = subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)
    return done.stdout.splitlines()[-1]


def main() -> None:
    """Print pytest's own figures."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "systems.py").write_text("".join(SYSTEM.format(name=name) for name in NAMES))
        for name in NAMES:
            Path(folder, f"test_{name.lower()}.py").write_text(TESTS.format(name=name))
        print(f"nothing: {collected(folder, 'test_first.py')}")
        print(f"a search: {collected(folder, '--garl-budget=400')}")
        cases = Path(folder, "scenarios", "regressions", "systems")
        cases.mkdir(parents=True)
        sample = case_of(0)
        for seed in range(CASES):
            scenario = dataclasses.replace(sample.scenario, seed=seed)
            case = dataclasses.replace(sample, scenario=scenario)
            (cases / f"{case.id}.toml").write_text(dump_case(case))
        print(f"{CASES} cases: {collected(folder, 'test_first.py')}")


if __name__ == "__main__":
    main()
