"""Keys of stashes and of reports, and questions about items that cost nothing.

Every pytest run imports this module, so it imports as little as it can.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from pytest_garl.plugin.target import Target

RUN = pytest.StashKey[Any]()
"""Where a session keeps its run; none if nothing is to be flown."""
TALLY = pytest.StashKey[Any]()
"""Where a session that is no xdist worker keeps what its reports say."""
COLLECTED = pytest.StashKey[Any]()
"""Where a session keeps which files and landing tests it collected."""
LANDING = pytest.StashKey[Any]()
"""Where an item keeps the landing that it asked for."""
BODY_RUNS = pytest.StashKey[bool]()
"""Where an item keeps whether the test's body runs."""
GATE_PLUGIN = "garl_baseline_gate"
"""The name under which the plugin of a baseline gate is registered."""

# User properties of reports, which xdist carries from its workers to the controller.
SLOT = "garl.slot"
"""The slot of an item; empty if it has nothing to fly."""
FLIGHT = "garl.flight"
"""The search and the slot of an item's flight; all items that judge this flight have the same."""
NO_FLIGHT = "garl.nothing"
"""Why an item has nothing to fly."""
OUTCOME = "garl.outcome"
"""The outcome of an item's flight; an item that flew nothing has none."""
SIGNATURE = "garl.signature"
"""The signature of a flight's violation, empty if there is none."""
SEVERITY = "garl.severity"
"""What the violation of a saved case took in its flight, in words; may be empty."""
TRAJECTORY = "garl.trajectory_sha256"
"""The hash of a flight's trajectory; empty if its process left no record."""
UNPROVEN = "garl.unproven"
"""Why it proves nothing if a saved case passes."""
EXPECTED = "garl.expected"
"""A saved case whose flight violates what is known of it, so that a failing test is excused."""
REPORTED_FAILURE = "garl.failure"
"""The failure that an item reports, as a key that is the same for all items which show it."""
DUPLICATE_OF = "garl.excused"
"""The failure that another item reports, by which an item is excused."""
EXCUSED = "garl.known"
"""A violation of a search that a known case excuses: system, map, slot, ending, file, as JSON."""
NOT_REPEATED = "garl.unrepeated"
"""System, map, slot and signature of a violation that did not show in other flights."""
USER_FAILURE = "garl.own_failure"
"""Search, slot, signature and message of a failed assertion about a user's own property."""
SHOWN_VIOLATION = "garl.shown"
"""The search and the slot of a built-in violation for which an item fails or is expected to."""
LEFT_TO_ANOTHER = "garl.left"
"""The search and the slot of a violation that an item leaves to another test of the slot."""
GATE = "garl.gates"
"""The system and the map that a baseline's gate compares."""
GATE_REPORT = "garl.gate"
"""One line that a baseline's gate reports; the summary writes them all."""
PAGE = "garl.page"
"""The page of a violation in the report of the run: its address, or its file below the root."""
CASE = "garl.case"
"""The file of a case that fails."""
MAYBE_FIXED = "garl.maybe_fixed"
"""The file of an open case that passes."""
STALE = "garl.stale"
"""The file of an open case that passes without proof, and why."""
WORKER_ASSERTION = "garl.own"
"""A worker's item failed in an assertion about a user's own property: its signature."""
FINDING_TEST = "garl.found"
"""A worker's item failed for a violation that a search found: the search and the signature."""
OUTSIDE = "garl.outside"
"""A saved case whose values lie outside the test's domain, and which of them."""
RENEWABLE = "garl.renewable"
"""A case that fails to the byte with other sources than its own."""
LOST = "garl.lost"
"""A file of the corpus that nothing can fly any more, and why."""
FOUND = "garl.item"
"""What an item found that is no test: a gate, probes, or a file that is lost; it fails for that."""
VIOLATED_PROBE = "garl.probe"
"""A probe that a landing system violates: the system, the map, and how the probe ended."""
NO_PARAMETERS = (
    "the fixture 'landing' needs an item for each flight, and pytest makes them only of a "
    "function, or of a method of a plain class (no unittest.TestCase), that takes landing as an "
    "argument"
)
"""Why a test cannot have a landing although it asked for one."""
FATAL = "garl.fatal"
"""Why the run cannot go on."""


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


def target_of(item: pytest.Item) -> Target | None:
    """Return the target of an item, or None if it is no landing test."""
    callspec = getattr(item, "callspec", None)
    target = callspec.params.get("garl_slot") if callspec else None
    # If there is nothing to fly, the parameter is the reason, a string.
    return None if isinstance(target, str) else target


def has_slot(item: pytest.Item) -> bool:
    """Whether an item is one of a landing test, be there something to fly or not."""
    callspec = getattr(item, "callspec", None)
    return callspec is not None and "garl_slot" in callspec.params


def without_landing(item: pytest.Item) -> str:
    """Return why a marked test that does not take ``landing`` is an error."""
    names = getattr(item, "fixturenames", ())
    if "garl_slot" in names:
        # Plain functions and methods that name the fixture have their slots by then.
        return f"{item.nodeid}: {NO_PARAMETERS}"
    if "landing" in names:
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


def name_slots(items: Iterable[pytest.Item]) -> None:
    """Name the slot of each landing item in its reports, even if it is not flown."""
    for item in items:
        callspec: Any = getattr(item, "callspec", None)
        slot = callspec.params.get("garl_slot") if callspec else None
        if isinstance(slot, str):
            item.user_properties += [(SLOT, ""), (NO_FLIGHT, slot)]
        elif slot is not None:
            item.user_properties.append((SLOT, slot.name))
