"""The search methods by name; each is one module behind one interface."""

from __future__ import annotations

import importlib
import itertools
import math
import reprlib
import traceback
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NoReturn, TypeVar

from pytest_garl.errors import GarlError
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.method import Flown, Method, Plan

T = TypeVar("T")

METHODS: Mapping[str, str] = MappingProxyType(
    {
        "garl": "pytest_garl.search.methods.garl:Garl",
        "garl-paper": "pytest_garl.search.methods.garl_paper:method",
        "ga": "pytest_garl.search.methods.ga:method",
        "offline-rl": "pytest_garl.search.methods.offline_rl:method",
        "online-rl": "pytest_garl.search.methods.online_rl:method",
        "random": "pytest_garl.search.methods.random_search:RandomSearch",
        "surrogate-random": "pytest_garl.search.methods.surrogate_random:method",
    }
)
"""Where each method is made, so that only the one in use is imported."""


def find_method(name: str) -> Callable[[Plan], Method]:
    """Return the factory of a shipped method, or of one named "module:factory"."""
    module, _, attribute = METHODS.get(name, name).partition(":")
    try:
        make: Callable[[Plan], Method] = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise GarlError(
            f"search method {name!r}: cannot be loaded ({error}); expected one of "
            f"{', '.join(METHODS)}, or 'module:factory' of an importable module"
        ) from error
    return make


def make_method(name: str, plan: Plan) -> Method:
    """Return a fresh search by the method called ``name``.

    Raises GarlError, there and later, where a user's own method raises or returns nonsense.
    """
    make = find_method(name)
    return make(plan) if name in METHODS else _Own(name, make, plan)


class _Own:
    """A user's own method; whatever is wrong with it is one error that names it."""

    def __init__(self, name: str, make: Callable[[Plan], Method], plan: Plan) -> None:
        self._name, self._population = name, plan.population
        self._method = self._call("the factory", lambda: make(plan))
        missing = [each for each in ("learns", "ask", "tell") if not hasattr(self._method, each)]
        if missing:
            self._refuse("the factory", self._method, f"a method with {', '.join(missing)}")

    @property
    def learns(self) -> bool:
        return bool(self._method.learns)

    def ask(self) -> Sequence[Scenario]:
        found = self._call("ask()", self._method.ask)
        right = isinstance(found, Sequence) and all(isinstance(each, Scenario) for each in found)
        if not right or len(found) < self._population:
            self._refuse("ask()", found, f"a list of {self._population} pytest_garl scenarios")
        return found

    def tell(self, flown: Sequence[Flown]) -> Sequence[tuple[float, ...]]:
        told = self._call("tell()", lambda: self._method.tell(flown))
        try:
            found = [tuple(float(value) for value in each) for each in told]
        except (TypeError, ValueError):
            found = []
        if len(found) != len(flown) or not all(map(math.isfinite, itertools.chain(*found))):
            expected = f"a list of {len(flown)} tuples of finite numbers, one for each flight"
            self._refuse("tell()", told, expected)
        return found

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
            "(pytest_garl.search.method.Method tells more)"
        )
