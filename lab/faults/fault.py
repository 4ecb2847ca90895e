"""A planted fault: its report, its landing system, its control, a scenario that fires it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lab.faults.control import ControlSystem
from pytest_garl.execution.fly_and_judge import judged
from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.files import load
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS, ViolationType

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


def result_of(system: System, scenario: Scenario, npcs: PolicySpec) -> FlightResult:
    """Fly a landing system through a scenario; return the judged result."""
    return judged(fly(scenario, system, npcs, map=load_map(scenario.map)), DEFAULT_LIMITS)


def finds(fault: Fault, scenario: Scenario, npcs: PolicySpec, faulty: FlightResult) -> bool:
    """Whether a scenario finds a fault, given the result of the faulty system.

    The control flies only if the faulty system violates.
    """
    if not faulty.verdict.violation:
        return False
    return not result_of(fault.control, scenario, npcs).verdict.violation
