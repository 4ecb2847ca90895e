"""What an item and its report tell those that count and show: the one place of its properties.

An item notes fields in its ``user_properties``, which pytest copies into each of its reports and
xdist carries from a worker to the controller; what is decided about one report is noted in that
report alone.  JUnit XML shows the properties of an item, so each filled field is one property,
``garl.`` and the field's name; a field of several lines is one property for each line.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import Field, dataclass, fields
from typing import TYPE_CHECKING, Any

from pytest_garl.plugin.items.keys import RECORD_PREFIX, slot_of

if TYPE_CHECKING:
    import pytest


@dataclass(frozen=True, slots=True, kw_only=True)
class ItemRecord:
    """What is noted of an item; a field that has its default is not noted."""

    # Of a landing item, from its collection and its flight.
    slot: str | None = None
    """The slot of an item; empty if it has nothing to fly, None if it is no landing test."""
    no_flight: str = ""
    """Why an item has nothing to fly."""
    flight: str = ""
    """The search and the slot of an item's flight, the same for all items that judge it."""
    outcome: str | None = None
    """The outcome of an item's flight; an item that flew nothing has none."""
    signature: str | None = None
    """The signature of a flight's violation, empty if there is none."""
    story: str | None = None
    excuse: str | None = None
    """Why nobody could have landed, in words; empty if somebody could."""
    final_distance_m: float | None = None
    elapsed_s: float | None = None
    trajectory_sha256: str | None = None
    """The hash of a flight's trajectory; empty if its process left no record."""
    expected: bool = False
    """Whether a saved case's flight violates what is known of it, so that a failure is excused."""
    outside: str = ""
    """A saved case whose values lie outside the test's domain, and which of them."""
    unproven: str = ""
    """Why it proves nothing if a saved case passes."""
    renewable: str = ""
    """The file of a case that flies to the byte as before with other sources than its own."""
    page: str = ""
    """The page of a violation in the report of the run: its address, or its file below the root."""

    # Of a report: what its item shows, and how that was decided.
    system: str = ""
    map: str = ""
    search: str = ""
    failure_signature: str = ""
    """The signature of the violation, or of the assertion about a user's own property, that fails
    in an item; system, map and search are noted with it."""
    user_message: str | None = None
    """The message of a failed assertion about a user's own property; None of a violation."""
    shows_violation: bool = False
    """Whether an item fails for a built-in violation, or is expected to."""
    left_to_another: bool = False
    """Whether an item leaves the violation of its flight to another test of the slot."""
    reported_failure: str = ""
    """The failure that an item reports, as a key that is the same for all items which show it."""
    duplicate_of: str = ""
    """The failure that another item reports, by which an item is excused."""
    excused_by: str = ""
    """The file of the known case that excuses a violation of a search."""
    not_repeated: bool = False
    """Whether the violation did not show in other flights of the slot."""
    savable: bool = False
    """Whether a case of the failure can be saved, which this item's test judges then."""
    failing_case: str = ""
    """The file of a case that fails."""
    severity: str = ""
    """What the violation of a saved case took in its flight, in words."""
    maybe_fixed: str = ""
    """The file of an open case that passes."""
    stale: str = ""
    """The file of an open case that passes without proof, and why."""
    passes_elsewhere: str = ""
    """The file of an open case that passes on another physics engine than its own, and on which."""

    # Of items that are no tests: a gate, probes, or a file that is lost.
    found: str = ""
    """What such an item found; it fails for that."""
    gate: str = ""
    """The system and the map that a baseline's gate compares."""
    gate_report: tuple[str, ...] = ()
    """The lines that a baseline's gate reports."""
    violated_probes: tuple[str, ...] = ()
    """The probes that a landing system violates: system, map, and how the probe ended."""
    lost: str = ""
    """A file of the corpus that nothing can fly any more, and why."""

    fatal: str = ""
    """Why the run cannot go on."""

    @classmethod
    def of(cls, source: object) -> ItemRecord:
        """Return what an item or a report says.

        A module that is skipped at its collection has a report without properties.  Properties of
        other plugins, and of users, are passed over.
        """
        found: dict[str, Any] = {}
        for name, value in getattr(source, "user_properties", ()):
            field = _FIELDS.get(name)
            if field is not None:
                lines = field.default == ()
                found[field.name] = (*found.get(field.name, ()), value) if lines else value
        return cls(**found)

    def add_to(self, target: pytest.Item | pytest.TestReport) -> None:
        """Note the filled fields in an item or a report; they replace what it says of them.

        An item that runs again, as of pytest-rerunfailures, has its properties of the first time.
        """
        filled: dict[str, tuple[Any, ...]] = {}
        for name, field in _FIELDS.items():
            value = getattr(self, field.name)
            if value != field.default:
                filled[name] = value if isinstance(value, tuple) else (value,)
        others = [each for each in target.user_properties if each[0] not in filled]
        noted = [(name, value) for name, values in filled.items() for value in values]
        target.user_properties[:] = others + noted


_FIELDS: dict[str, Field[Any]] = {
    f"{RECORD_PREFIX}{field.name}": field for field in fields(ItemRecord)
}
"""The fields by the names of their properties."""


def records(reporter: Any, *outcomes: str) -> Iterator[ItemRecord]:
    """Yield what the reports with some outcomes say; ``reporter`` is the terminal's."""
    for outcome in outcomes:
        yield from map(ItemRecord.of, reporter.getreports(outcome))


def name_slots(items: Iterable[pytest.Item]) -> None:
    """Name the slot of each landing item in its reports, even if it is not flown."""
    for item in items:
        slot = slot_of(item)
        if isinstance(slot, str):
            ItemRecord(slot="", no_flight=slot).add_to(item)
        elif slot is not None:
            ItemRecord(slot=slot.name).add_to(item)
