"""Events during a flight that a scenario names: the camera fails, frames are delayed."""

from __future__ import annotations

from pytest_garl.scenarios.scenario import Scenario


class Event:
    """What happens from a group's ``from_s`` on, for its ``lasts_s``."""

    def __init__(self, scenario: Scenario, group: str) -> None:
        self._from_s = scenario[f"{group}.from_s"]
        self._until_s = self._from_s + scenario[f"{group}.lasts_s"]

    def happens(self, time_s: float) -> bool:
        """Whether it happens at a time of the flight."""
        return self._from_s <= time_s < self._until_s
