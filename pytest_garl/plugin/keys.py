"""Keys of what a session and its items keep, names of what reports carry, and quick questions.

Every pytest run imports this module, so it imports as little as it can.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from pytest_garl.plugin.target import Target

GATE_PLUGIN = "garl_baseline_gate"
"""The name under which the plugin of a baseline gate is registered."""
RUN = pytest.StashKey[Any]()
"""Where a session keeps its run; none if nothing is to be flown."""
LANDING = pytest.StashKey[Any]()
"""Where an item keeps the landing that it asked for."""
BEGUN = pytest.StashKey[bool]()
"""Where an item keeps whether the test's body runs."""
FATAL = "garl.fatal"
"""The user property by which an xdist worker tells the controller that the run cannot go on."""
OWN = "garl.own"
"""The user property by which it tells of a test that failed in an assertion of its own."""
FOUND = "garl.found"
"""The user property by which it tells that a test failed for a search's violation."""
TALLY = pytest.StashKey[Any]()
"""Where a session that is no xdist worker keeps what its items say."""
SLOT = "garl.slot"
"""The user property that names the slot of an item."""
OUTCOME = "garl.outcome"
"""The user property with the outcome of an item's flight; an item that flew nothing has none."""
SIGNATURE = "garl.signature"
"""The user property with the signature of a flight's violation, empty if there is none."""
UNPROVEN = "garl.unproven"
"""The user property that says why it proves nothing if a saved case passes."""
NOTHING = "garl.nothing"
"""The user property of an item that has nothing to fly, with the reason."""
FAILURE = "garl.failure"
"""The user property that names what a failing item tells of."""
EXCUSED = "garl.excused"
"""The user property of an item that is excused, with what another item tells of."""
UNREPEATED = "garl.unrepeated"
"""The user property of a violation that did not show when it was flown again."""
OWN_FAILURE = "garl.own_failure"
"""The user property that tells the summary of a failed assertion about the user's own property."""
CASE = "garl.case"
"""The user property that names the file of a case that fails."""
MAYBE_FIXED = "garl.maybe_fixed"
"""The user property that names the file of an open case that passes."""
UNPROVEN = "garl.unproven"
"""The user property that says why it proves nothing that a case passes."""
STALE = "garl.stale"
"""The user property that names the file of an open case that passes without proof, and why."""


def is_xdist_worker(config: pytest.Config) -> bool:
    """Whether this process is one of pytest-xdist's workers."""
    return hasattr(config, "workerinput")


def is_landing_item(item: pytest.Item) -> bool:
    """Whether an item needs a run: a landing test, or a gate against a baseline."""
    return target_of(item) is not None or hasattr(item, "garl_gate")


def target_of(item: pytest.Item) -> Target | None:
    """Return what an item tests, or None for an item that is not ours."""
    callspec = getattr(item, "callspec", None)
    target = callspec.params.get("garl_slot") if callspec else None
    # Where there is nothing to fly the parameter is the reason, a string.
    return None if isinstance(target, str) else target


def name_slots(items: Iterable[pytest.Item]) -> None:
    """Let the reports of landing tests tell what they test, whether or not it is flown."""
    for item in items:
        callspec: Any = getattr(item, "callspec", None)
        slot = callspec.params.get("garl_slot") if callspec else None
        if isinstance(slot, str):
            item.user_properties += [(SLOT, ""), (NOTHING, slot)]
        elif slot is not None:
            item.user_properties.append((SLOT, slot.name))
