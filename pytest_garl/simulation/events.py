"""Events during a flight that a scenario names: the camera fails, frames are delayed."""

from __future__ import annotations

from typing import Protocol

from pytest_garl.scenarios.groups import QUANTITIES
from pytest_garl.scenarios.scenario import Scenario


class Moments(Protocol):
    """The moments of a landing: of one that is flown, or of its record."""

    @property
    def began_s(self) -> tuple[float, ...]:
        """When each came, infinite for those that did not."""


class Beginning:
    """When an event begins: a group's ``from_s`` after the moment that its ``after`` names."""

    def __init__(self, scenario: Scenario, group: str, moments: Moments) -> None:
        key = f"{group}.after"
        self._moment = int(QUANTITIES[key].flown(scenario[key]))
        self._delay_s, self._moments = scenario[f"{group}.from_s"], moments

    @property
    def time_s(self) -> float:
        """The time of the flight; infinite if the moment has not come."""
        return self._moments.began_s[self._moment] + self._delay_s


class Event:
    """What happens from its beginning on, for a group's ``lasts_s``."""

    def __init__(self, scenario: Scenario, group: str, moments: Moments) -> None:
        self._begins = Beginning(scenario, group, moments)
        self._lasts_s = scenario[f"{group}.lasts_s"]

    def happens(self, time_s: float) -> bool:
        """Whether it happens at a time of the flight."""
        if self._lasts_s == 0:
            return False
        begins_s = self._begins.time_s
        return begins_s <= time_s < begins_s + self._lasts_s
