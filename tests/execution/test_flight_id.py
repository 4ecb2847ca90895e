from __future__ import annotations

import hashlib
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from pytest_garl.execution.flight_id import FIRST_SLOT, FlightId, Slot, search_key


def test_key_is_a_prefix_of_the_facts_hash() -> None:
    assert search_key("facts") == hashlib.sha256(b"facts").hexdigest()[:16]


def test_record_is_named_after_search_and_slot() -> None:
    flight = FlightId(search="0123456789abcdef", map="court", slot=Slot(generation=3, index=17))
    assert flight.name == "01234567-court-g03-s17"
    assert flight.record(Path("flights")) == Path("flights/01234567-court-g03-s17.npz")
    assert flight.key == ("0123456789abcdef", 3, 17)


def test_search_of_one_flight_has_the_first_slot() -> None:
    flight = FlightId(search=search_key("once"), map="lawn")
    assert flight.slot == FIRST_SLOT == Slot(generation=0, index=0)


@given(st.lists(st.tuples(st.integers(0, 200), st.integers(0, 99)), unique=True, max_size=20))
def test_flights_of_one_search_have_different_records(slots: list[tuple[int, int]]) -> None:
    names = {
        FlightId(search="s", map="lawn", slot=Slot(generation=g, index=i)).name for g, i in slots
    }
    assert len(names) == len(slots)
