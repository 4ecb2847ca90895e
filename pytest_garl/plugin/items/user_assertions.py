"""Run the assertions of users' tests on any flight."""

from __future__ import annotations

import contextlib
import inspect
from collections.abc import Callable
from typing import Any

import pytest

from pytest_garl.cases.user_failure import UserFailure
from pytest_garl.errors import GarlError
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.plugin.items.failed_statement import FAILED_ASSERTION_TYPES, failure_of
from pytest_garl.plugin.items.keys import target_of
from pytest_garl.plugin.items.landing import Landing
from pytest_garl.plugin.items.outcomes import why_unjudged
from pytest_garl.plugin.items.target import Target
from pytest_garl.scenarios.scenario import Scenario

_AVAILABLE = {"landing", "scenario"}


def collect_assertion(session: pytest.Session, nodeid: str) -> tuple[Target, ItemAssertion]:
    """Return target and assertion of a test that an xdist worker ran.

    The controller has collected nothing, so the test's file is collected here.  Raises GarlError
    if the file does not have the test.
    """
    path = session.config.rootpath / nodeid.partition("::")[0]
    nodes: list[Any] = [pytest.Module.from_parent(session, path=path)]
    for node in nodes:
        if isinstance(node, pytest.Function) and node.nodeid == nodeid:
            target = target_of(node)
            assert target is not None
            return target, ItemAssertion(node, target)
        if isinstance(node, pytest.Collector) and nodeid.startswith(node.nodeid):
            nodes.extend(node.collect())
    raise GarlError(f"{nodeid}: a worker ran it, but it is not found in {path}")


class ItemAssertion:
    """The assertions of an item's test, for tests that take nothing but a flight."""

    def __init__(self, item: pytest.Function, target: Target) -> None:
        self._function: Callable[..., Any] = item.obj
        self._parameters = set(inspect.signature(item.obj).parameters)
        self._target = target
        self.test = item.originalname

    @property
    def runs_on_any_flight(self) -> bool:
        """Whether the test can run on any flight: it takes no fixture but landing and scenario.

        An asynchronous test runs only in the loop of its plugin.
        """
        return self._parameters <= _AVAILABLE and not inspect.iscoroutinefunction(self._function)

    def __call__(self, flight: CompletedFlight, scenario: Scenario) -> UserFailure | None:
        """Return how the test fails on a flight without built-in violation, or None.

        A saved case of a user's property shows that property alone.
        """
        violates = flight.result.verdict.violation
        return None if violates else self.failure(flight, scenario)

    def failure(
        self,
        flight: CompletedFlight,
        scenario: Scenario,
        is_shown_elsewhere: Callable[[], bool] = lambda: False,
    ) -> UserFailure | None:
        """Return how the test fails on a flight, or None."""
        if why_unjudged(flight.result):
            return None
        landing = Landing(
            self._target, flight, self._function, is_shown_elsewhere=is_shown_elsewhere
        )
        arguments = {"landing": landing, "scenario": scenario}
        # Another exception, or a skip, is no failed assertion.
        with contextlib.suppress(Exception, pytest.skip.Exception):
            try:
                self._function(**{name: arguments[name] for name in self._parameters})
            except FAILED_ASSERTION_TYPES as error:
                return failure_of(self.test, self._function, error, landing.reads)
        return None
