"""How long pytest takes to collect 7,200 items: 3 systems, 2 maps, budget 400, 3 tests."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

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


def main() -> None:
    """Print pytest's own figure."""
    with tempfile.TemporaryDirectory() as folder:
        names = ("First", "Second", "Third")
        Path(folder, "systems.py").write_text("".join(SYSTEM.format(name=name) for name in names))
        for name in names:
            Path(folder, f"test_{name.lower()}.py").write_text(TESTS.format(name=name))
        command = [sys.executable, "-m", "pytest", "-q", "--collect-only", "--garl-budget=400"]
        done = subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)
        print(done.stdout.splitlines()[-1])


if __name__ == "__main__":
    main()
