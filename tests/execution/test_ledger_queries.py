from __future__ import annotations

import os
from pathlib import Path

from pytest_garl.execution.ledger import Ledger
from tests.execution.ledgers import waiting_ledger
from tests.support.results import crash, flight_result


def test_hash_ignores_the_stacks_of_an_ended_process(tmp_path: Path) -> None:
    def flown(path: Path, text: str) -> str:
        ledger = waiting_ledger(path)
        claim = ledger.queue.claim()
        assert claim is not None
        ledger.queue.record(claim, flight_result(crash=crash(traceback=text)), "", 0.0)
        return ledger.queries.result_hash()

    assert flown(tmp_path / "one.sqlite", "line 3") == flown(tmp_path / "two.sqlite", "line 4")


def test_hash_covers_results_but_no_costs(tmp_path: Path) -> None:
    hashes = set()
    for wall_s in (0.1, 0.2):
        ledger = waiting_ledger(tmp_path / "ledger.sqlite")
        claim = ledger.queue.claim()
        assert claim is not None
        where = f"Thread 0x{os.getpid() + int(10 * wall_s):x}"
        ledger.queue.record(claim, flight_result(undecided=where), "hash", wall_s)
        hashes.add(ledger.queries.result_hash())
        ledger.close()
    assert len(hashes) == 1


def test_each_search_has_its_own_hash_and_time(tmp_path: Path) -> None:
    def flown(path: Path, value: float) -> Ledger:
        ledger = waiting_ledger(path)
        ledger.add_search("t", "systems:Good", "lawn", 1, "{}")
        ledger.add_slots("t", 0, {0: "d"})
        while claim := ledger.queue.claim():
            result = flight_result(elapsed_s=value if claim.flight.search == "t" else 1)
            ledger.queue.record(claim, result, "hash", 0.5)
        return ledger

    one, other = flown(tmp_path / "one.sqlite", 1), flown(tmp_path / "other.sqlite", 2)
    assert one.queries.result_hash("s") == other.queries.result_hash("s")
    assert one.queries.result_hash("t") != other.queries.result_hash("t")
    assert (
        len({one.queries.result_hash(), one.queries.result_hash("s"), one.queries.result_hash("t")})
        == 3
    )
    assert (one.queries.flying_s("s"), one.queries.flying_s("t"), one.queries.flying_s("u")) == (
        1.5,
        0.5,
        0.0,
    )


def test_flights_are_those_with_a_result_in_slot_order(tmp_path: Path) -> None:
    ledger = waiting_ledger(tmp_path / "ledger.sqlite")
    claims = [ledger.queue.claim() for _ in range(2)]
    for claim in reversed(claims):
        assert claim is not None
        ledger.queue.record(claim, flight_result("IV:dog" if claim is claims[1] else ""), "ab", 0.1)
    flights = ledger.queries.flights()
    assert [each.id.slot.index for each in flights] == [0, 1]
    assert [each.signature for each in flights] == ["", "IV:dog"]
    assert [each.id for each in ledger.queries.violating()] == [flights[1].id]
    search = flights[0].id.search
    assert len(ledger.queries.flights(search)) == 2
    assert ledger.queries.flights("another") == []
    done = flights[1].completed(tmp_path)
    assert (done.signature, done.sha256) == ("IV:dog", "ab")
    assert done.record == flights[1].id.record(tmp_path)


def test_flight_with_a_shared_trajectory_is_that_of_the_scenario_or_of_the_signature(
    tmp_path: Path,
) -> None:
    ledger = waiting_ledger(tmp_path / "ledger.sqlite")
    for signature in ("II:gave-up-in-sight:approach", "II:never-seen", "II:never-seen"):
        claim = ledger.queue.claim()
        assert claim is not None
        ledger.queue.record(claim, flight_result(signature), "ab", 0.1)

    def found(**wanted: str) -> str | None:
        flight = ledger.queries.flight_with_hash("ab", **wanted)
        return flight.scenario if flight else None

    assert found(scenario="c", signature="II:never-seen") == "c"
    assert found(scenario="without what it never read", signature="II:never-seen") == "b"
    assert found(signature="own:test_it") == found() == "a"
    assert found(signature="IV:dog") is None
    assert ledger.queries.flight_with_hash("") is None


def test_generations_are_closed_in_order(tmp_path: Path) -> None:
    ledger = waiting_ledger(tmp_path / "ledger.sqlite")
    ledger.add_slots("s", 1, {0: "d"})
    claims = [ledger.queue.claim() for _ in range(4)]
    for claim in reversed(claims):
        assert claim is not None
        assert ledger.queries.closed_generations("s", -1) == []
        ledger.queue.record(claim, flight_result("IV:dog"), "", 1.0)
    assert ledger.queries.closed_generations("s", -1) == [0, 1]
    assert ledger.queries.closed_generations("s", 0) == [1]
    assert [flight.id.slot.index for flight in ledger.queries.violating("s", 0)] == [0, 1, 2]
    assert ledger.queries.wanted("s") == 3
