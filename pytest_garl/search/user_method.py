"""A user's own search method, checked at every call."""

from __future__ import annotations

import dataclasses
import itertools
import math
import reprlib
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NoReturn, TypeVar

from pytest_garl.errors import GarlError
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.method import FlownScenario, Method, SearchPlan

T = TypeVar("T")


class UserMethod:
    """Passes calls on to a user's own method; any mistake in it is a GarlError that names it.

    ``name`` is "module:factory", ``make`` that factory.
    """

    def __init__(self, name: str, make: Callable[[SearchPlan], Method], plan: SearchPlan) -> None:
        self._name, self._population = name, plan.population
        self._task = plan.genome.task
        self._method = self._call("the factory", lambda: make(plan))
        missing = [each for each in ("learns", "ask", "tell") if not hasattr(self._method, each)]
        if missing:
            self._refuse("the factory", self._method, f"a method with {', '.join(missing)}")

    @property
    def learns(self) -> bool:
        """Whether a generation depends on the results of earlier ones."""
        return bool(self._method.learns)

    @property
    def overlaps(self) -> bool:
        """Whether a generation may be asked for before the one before it is told; may be absent."""
        return bool(getattr(self._method, "overlaps", False))

    def ask(self) -> Sequence[Scenario]:
        """Return the next generation."""
        found = self._call("ask()", self._method.ask)
        right = isinstance(found, Sequence) and all(isinstance(each, Scenario) for each in found)
        if not right or len(found) < self._population:
            self._refuse("ask()", found, f"a list of {self._population} pytest_garl scenarios")
        # Which marker lies there, and where a flight starts, is the user's test's to say.
        return [dataclasses.replace(each, task=self._task) for each in found]

    def tell(self, flown: Sequence[FlownScenario]) -> Sequence[tuple[float, ...]]:
        """Let the method learn; return its objectives."""
        objectives = self._call("tell()", lambda: self._method.tell(flown))
        try:
            values = [tuple(float(value) for value in each) for each in objectives]
        except (TypeError, ValueError):
            values = []
        if len(values) != len(flown) or not all(map(math.isfinite, itertools.chain(*values))):
            expected = f"a list of {len(flown)} tuples of finite numbers, one for each flight"
            self._refuse("tell()", objectives, expected)
        return values

    def _call(self, what: str, function: Callable[[], T]) -> T:
        try:
            return function()
        except Exception as error:
            # Not ours to name: it is a user's code.
            frame = traceback.extract_tb(error.__traceback__)[-1]
            raise GarlError(
                f"search method {self._name!r}: {what} raised {type(error).__name__}: {error} "
                f"({Path(frame.filename).name}:{frame.lineno})"
            ) from error

    def _refuse(self, what: str, found: object, expected: str) -> NoReturn:
        shown = reprlib.repr(found)
        raise GarlError(
            f"search method {self._name!r}: {what} returned {shown}, expected {expected} "
            "(see pytest_garl.search.method.Method)"
        )
