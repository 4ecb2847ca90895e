"""Events during a flight that a scenario names: the camera fails, frames are delayed."""

from __future__ import annotations

from typing import Protocol

from pytest_garl.scenarios.groups import QUANTITIES
from pytest_garl.scenarios.scenario import Scenario


class Moments(Protocol):
    """The moments of a landing: of one that is flown, or of its record."""

    def of_event(self, name: str) -> tuple[float, ...]:
        """Return when each came for which an event may wait, infinite for those that did not."""


class Beginning:
    """When an event begins: a group's ``from_s`` after the moment that its ``after`` names.

    If that is the decision of the director, it begins with this.
    """

    def __init__(self, scenario: Scenario, group: str, moments: Moments) -> None:
        key = f"{group}.after"
        self._group, self._moments = group, moments
        self._moment = int(QUANTITIES[key].flown(scenario[key]))
        is_decided = group in scenario.decided_events
        self._delay_s = 0.0 if is_decided else scenario[f"{group}.from_s"]

    @property
    def time_s(self) -> float:
        """The time of the flight; infinite if the moment has not come."""
        return self._moments.of_event(self._group)[self._moment] + self._delay_s


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
