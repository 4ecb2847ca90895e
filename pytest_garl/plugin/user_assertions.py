"""A test's own assertion, asked of any flight: what a user demands beyond the built-in verdict."""

from __future__ import annotations

import contextlib
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.plugin.arguments import target_of
from pytest_garl.plugin.assertions import FAILS, Failure, failure_of
from pytest_garl.plugin.collection import Target
from pytest_garl.plugin.fixtures import Landing
from pytest_garl.regressions.case_request import OwnFailure
from pytest_garl.scenarios.scenario import Scenario

_GIVEN = {"landing", "scenario"}


def asks_of(session: pytest.Session, nodeid: str) -> tuple[Target, Asks]:
    """Return what a test asks that another process has run; this one has collected nothing."""
    path = session.config.rootpath / nodeid.partition("::")[0]
    nodes: list[Any] = [pytest.Module.from_parent(session, path=path)]
    for node in nodes:
        if isinstance(node, pytest.Function) and node.nodeid == nodeid:
            target = target_of(node)
            assert target is not None
            return target, Asks(node, target)
        if isinstance(node, pytest.Collector) and nodeid.startswith(node.nodeid):
            nodes.extend(node.collect())
    raise GarlError(f"{nodeid}: a worker ran it, but it is not found in {path}")


class Asks:
    """Runs an item's test on other flights; only for tests that take nothing but a flight."""

    def __init__(self, item: pytest.Function, target: Target) -> None:
        self._function: Callable[..., Any] = item.obj
        self._wanted = set(inspect.signature(item.obj).parameters)
        self._target = target
        self.test = item.originalname

    @property
    def possible(self) -> bool:
        """Whether the test takes nothing that this module cannot give."""
        return self._wanted <= _GIVEN

    def __call__(
        self, result: dict[str, Any], record: Path, scenario: Scenario
    ) -> OwnFailure | None:
        """Return how the test fails on a flight that violates nothing else, or None.

        A case of a property of the user's own is to show that property alone.
        """
        violates = result["verdict"]["primary"] is not None
        found = None if violates else self.failure(result, record, scenario)
        if found is None:
            return None
        return OwnFailure(
            test=found.test,
            assertion=found.digest,
            signature=found.signature,
            message=found.message,
        )

    def failure(self, result: dict[str, Any], record: Path, scenario: Scenario) -> Failure | None:
        """Return which assertion of the test fails on a flight, or None."""
        landing = Landing(self._target, result, record, self._function)
        if landing.unjudged:
            return None
        given = {"landing": landing, "scenario": scenario}
        # What else a test raises, or that it skips, is no failure of an assertion.
        with contextlib.suppress(Exception, pytest.skip.Exception):
            try:
                self._function(**{name: given[name] for name in self._wanted})
            except FAILS as error:
                return failure_of(self.test, self._function, error, landing.reads)
        return None
