"""The search methods by name, without the cost of importing them.

A shipped method is one module in ``search/methods/`` that declares ``METHOD``.  The method has the
name of the file, with dashes for underscores.  A user's own method is named "module:factory".

Every pytest run imports this catalogue for ``--help``.  So the catalogue imports only the module of
the method in use.
"""

from __future__ import annotations

import functools
import importlib
from pathlib import Path
from typing import TYPE_CHECKING

from pytest_garl.errors import GarlError
from pytest_garl.npcs.policy_catalogue import DEFAULT_POLICY

if TYPE_CHECKING:
    from collections.abc import Callable

    from pytest_garl.search.method import Method, MethodDeclaration, SearchPlan

DEFAULT_METHOD = "garl"
USE = "use"
"""The method that draws from a model of use."""


@functools.cache
def method_names() -> tuple[str, ...]:
    """Return the names of all shipped methods."""
    files = Path(__file__).with_name("methods").iterdir()
    modules = (file.stem for file in files if file.suffix == ".py" and file.stem != "__init__")
    return tuple(sorted(name.replace("_", "-") for name in modules))


def declaration_of(name: str) -> MethodDeclaration:
    """Return the declaration in the module of a shipped method."""
    module = importlib.import_module(f"{__package__}.methods.{name.replace('-', '_')}")
    found: MethodDeclaration = module.METHOD
    return found


def default_policy(name: str) -> str:
    """Return the NPC policy that belongs to a method, for searches that name no policy."""
    return declaration_of(name).policy if name in method_names() else DEFAULT_POLICY


def remembers(name: str) -> bool:
    """Return whether a method uses an archive; True for a user's own method, which may."""
    return name not in method_names() or declaration_of(name).remembers


def find_method(name: str) -> Callable[[SearchPlan], Method]:
    """Return the factory of a shipped method, or of one named "module:factory".

    Raises GarlError if it cannot be imported.
    """
    if name in method_names():
        return declaration_of(name).make
    module, _, attribute = name.partition(":")
    try:
        make: Callable[[SearchPlan], Method] = getattr(importlib.import_module(module), attribute)
    except Exception as error:
        # A user's module may raise anything.
        raise GarlError(
            f"search method {name!r}: cannot be loaded ({type(error).__name__}: {error}); expected "
            f"one of {', '.join(method_names())}, or 'module:factory' of an importable module"
        ) from error
    return make


def make_method(name: str, plan: SearchPlan) -> Method:
    """Return a fresh search by the method called ``name``.

    Raises GarlError if the method needs an extra that is not installed.  If a user's own method
    raises, or returns something invalid, this function or the returned method raises GarlError.
    """
    if name not in method_names():
        from pytest_garl.search.user_method import UserMethod

        return UserMethod(name, find_method(name), plan)
    declared = declaration_of(name)
    try:
        return declared.make(plan)
    except ImportError as error:
        if not declared.extra:
            raise
        raise GarlError(
            f"the search method {name} needs packages that flying does not need ({error}): "
            f"pip install 'pytest-garl[{declared.extra}]', or choose another --garl-method"
        ) from error
