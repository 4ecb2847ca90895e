"""A planted fault: its report, its landing system, its control, a scenario that fires it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lab.faults.control import ControlSystem
from pytest_garl.scenarios.files import load
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.verdicts.verdict import ViolationType

SCENARIOS = Path(__file__).with_name("scenarios")
System = Callable[[], Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """One faulty landing system.

    ``links`` are the public reports that it is modelled on, ``summary`` says what is wrong.  The
    hand-made scenario is flown on ``map`` and violates with the type ``fires``; searches fly on
    ``map`` too.
    """

    name: str
    family: str
    links: tuple[str, ...]
    summary: str
    faulty: System
    fires: ViolationType
    map: str = "lawn"
    control: System = ControlSystem

    @property
    def file(self) -> Path:
        """The file of the hand-made scenario."""
        return SCENARIOS / f"{self.name}.toml"

    @property
    def scenario(self) -> Scenario:
        """The hand-made scenario."""
        return load(self.file)
