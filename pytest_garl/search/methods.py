"""The search methods by name; each is one module behind one interface."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from types import MappingProxyType

from pytest_garl.errors import GarlError
from pytest_garl.search.method import Method, Plan

METHODS: Mapping[str, str] = MappingProxyType(
    {
        "garl": "pytest_garl.search.garl:Garl",
        "garl-paper": "pytest_garl.search.garl_paper:method",
        "ga": "pytest_garl.search.ga:method",
        "offline-rl": "pytest_garl.search.offline_rl:method",
        "online-rl": "pytest_garl.search.online_rl:method",
        "random": "pytest_garl.search.random_search:RandomSearch",
        "surrogate-random": "pytest_garl.search.surrogate_random:method",
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
    """Return a fresh search by the method called ``name``."""
    return find_method(name)(plan)
