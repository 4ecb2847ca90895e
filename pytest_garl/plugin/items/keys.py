"""Keys of stashes, and questions about items that cost nothing.

Every pytest run imports this module, so it imports as little as it can.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from pytest_garl.plugin.items.target import Target

RUN = pytest.StashKey[Any]()
"""Where a session keeps its run; none if nothing is to be flown."""
TALLY = pytest.StashKey[Any]()
"""Where a session that is no xdist worker keeps what its reports say."""
COLLECTED = pytest.StashKey[Any]()
"""Where a session keeps which files and landing tests it collected."""
LANDING = pytest.StashKey[Any]()
"""Where an item keeps the landing that it asked for."""
REPEATED = pytest.StashKey[Any]()
"""Where a session keeps the scenario that ``--garl-repeat`` names; none without it."""
BODY_RUNS = pytest.StashKey[bool]()
"""Where an item keeps whether the test's body runs."""
GATE_PLUGIN = "garl_baseline_gate"
"""The name under which the plugin of a baseline gate is registered."""
SLOT_FIXTURE = "garl_slot"
"""The fixture whose parameter is what an item flies; ``fixtures`` defines it under this name."""
RECORD_PREFIX = "garl."
"""Begins the names of all properties of an ``ItemRecord``."""
NO_PARAMETERS = (
    "the fixture 'landing' needs an item for each flight, and pytest makes them only of a "
    "function, or of a method of a plain class (no unittest.TestCase), that takes landing as an "
    "argument"
)
"""Why a test cannot have a landing although it asked for one."""


def is_landing_item(item: pytest.Item) -> bool:
    """Whether an item needs a run: a landing test, or a gate against a baseline."""
    return target_of(item) is not None or hasattr(item, "garl_gate")


def marker_of(item: pytest.Item) -> pytest.Mark | None:
    """Return an item's mark ``garl``; that of a parameter comes before that of the test."""
    callspec: Any = getattr(item, "callspec", None)
    return marker_among(callspec.marks if callspec else ()) or closest_mark(item)


def closest_mark(item: pytest.Item) -> pytest.Mark | None:
    """Return the mark ``garl`` of a test, or of its class, or of its module; the nearest wins.

    Raises CollectError if two stand at one place: pytest would take either, and the landing system
    of the other would never be flown.
    """
    for node in item.iter_parents():
        marks = [mark for mark in node.own_markers if mark.name == "garl"]
        if len(marks) > 1 and isinstance(node, pytest.Class):
            marks = _marks_of_class(node.obj) or marks
        if len(marks) > 1:
            raise pytest.Collector.CollectError(
                f"{node.nodeid}: has {len(marks)} marks garl, and a test flies one of them; for "
                "several maps name all in maps=[...], for several landing systems give each to a "
                "parameter: pytest.param(System, marks=pytest.mark.garl(system=System))"
            )
        if marks:
            return marks[0]
    return None


def _marks_of_class(cls: type) -> list[pytest.Mark]:
    """Return the marks ``garl`` of a class, else those of its nearest base class.

    To pytest those of all base classes are the class's own, and come first.
    """
    for each in cls.__mro__:
        found: Any = vars(each).get("pytestmark", ())
        own: list[Any] = found if isinstance(found, list) else [found]
        marks = [getattr(mark, "mark", mark) for mark in own]
        if found := [mark for mark in marks if getattr(mark, "name", "") == "garl"]:
            return list(found)
    return []


def marker_among(marks: Iterable[Any]) -> pytest.Mark | None:
    """Return the mark ``garl`` of a parameter, given its marks and decorators."""
    found = [mark for mark in marks if mark.name == "garl"]
    return getattr(found[-1], "mark", found[-1]) if found else None


def slot_of(item: pytest.Item) -> Target | str | None:
    """Return what an item of a landing test flies, or why nothing; None of any other item."""
    callspec: Any = getattr(item, "callspec", None)
    slot: Target | str | None = callspec.params.get(SLOT_FIXTURE) if callspec else None
    return slot


def target_of(item: pytest.Item) -> Target | None:
    """Return the target of an item, or None if it flies nothing."""
    slot = slot_of(item)
    return None if isinstance(slot, str) else slot


def takes_landing(test: object) -> bool:
    """Whether a test, or what pytest makes its items of, uses the fixture ``landing``."""
    return SLOT_FIXTURE in getattr(test, "fixturenames", ())


def without_landing(item: pytest.Item) -> str:
    """Return why a marked test that does not take ``landing`` is an error."""
    if takes_landing(item):
        # Plain functions and methods that name the fixture have their slots by then.
        return f"{item.nodeid}: {NO_PARAMETERS}"
    if "landing" in getattr(item, "fixturenames", ()):
        return (
            f"{item.nodeid}: its 'landing' is not the fixture of pytest-garl, but a fixture of the "
            "project or a parameter of the same name, so it flies nothing; rename that, or let it "
            "take landing itself"
        )
    return (
        f"{item.nodeid}: carries @pytest.mark.garl and does not take the fixture 'landing', so "
        "it flies nothing; give it the argument landing, or take the mark off it (the mark of "
        "a module or a class is on all its tests)"
    )
