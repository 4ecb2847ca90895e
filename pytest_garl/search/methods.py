"""The search methods by name; each is one module behind one interface."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from types import MappingProxyType

from pytest_garl.search.method import Method, Plan

METHODS: Mapping[str, str] = MappingProxyType(
    {
        "garl": "pytest_garl.search.garl:method",
        "garl-paper": "pytest_garl.search.garl_paper:method",
        "random": "pytest_garl.search.random_search:RandomSearch",
    }
)
"""Where each method is made, so that only the one in use is imported."""


def make_method(name: str, plan: Plan) -> Method:
    """Return a fresh search by the method called ``name``."""
    module, _, attribute = METHODS[name].partition(":")
    make: Callable[[Plan], Method] = getattr(importlib.import_module(module), attribute)
    return make(plan)
