"""Investigations beside a search: what they fly depends on no worker and on no interruption."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queue import Claim
from pytest_garl.shrinking.case_request import CaseResult
from pytest_garl.triage.allowance import ShrinkBudget
from pytest_garl.triage.investigation_queue import Investigations
from tests.cases.running_search import RunningSearch, UnpunctualPool, corpus_of

GENERATIONS = (
    ["", "fog", "", "", "rain", "fog", "", ""],
    ["", "", "snow", "rain", "", "", "", ""],
    ["road_wetness", "", "", "fog", "", "", "", ""],
)
WANTED = sum(map(len, GENERATIONS))
CAPPED, EACH = ShrinkBudget(each=12, capped=True), ShrinkBudget(each=12, capped=False)
Results = dict[str, CaseResult]


class Session:
    """A run in one process: it breeds, lets the pool fly, and goes on with the investigations."""

    def __init__(
        self, path: Path, shrinking: ShrinkBudget, workers: int = 1, seed: int = 0
    ) -> None:
        new = not path.exists()
        self.ledger = Ledger.create(path, {}) if new else Ledger.resume(path, {})
        self.search = RunningSearch(self.ledger, WANTED)
        self.flown: list[str] = []
        self.pool = UnpunctualPool(self.ledger, workers, seed, self._note)
        self.investigations = Investigations(
            self.ledger, self.pool, corpus_of(), shrinking, workers
        )

    def run(self, on_wait: Callable[[], None] = lambda: None) -> Results:
        """Fly the search and everything that follows it."""
        try:
            for generation, causes in enumerate(GENERATIONS):
                self.search.add_generation(generation, causes)
                while self.ledger.queries.unflown("search", generation):
                    self.investigations.advance()
                    self.pool.turn()
                    on_wait()
            return self.investigations.finish(self.investigations.requests({}), on_wait)
        finally:
            self.investigations.close()
            self.pool.close()
            self.ledger.close()

    def _note(self, claim: Claim) -> None:
        self.flown.append("search" if claim.flight.search == "search" else "beside")


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[bool, tuple[Results, set[str]]]:
    """Return the results and the flights of a run with one worker, by whether there is a cap."""
    found = {}
    for shrinking in (CAPPED, EACH):
        path = tmp_path_factory.mktemp("one") / "ledger.sqlite"
        found[shrinking.capped] = Session(path, shrinking).run(), flights(path)
    return found


def flights(path: Path) -> set[str]:
    """Return the keys of all flights in a ledger that were flown."""
    ledger = Ledger(path)
    try:
        rows = ledger.database.execute(
            "SELECT search, generation, slot FROM slot WHERE state='flown'"
        )
        return {str(row) for row in rows}
    finally:
        ledger.close()


@pytest.mark.parametrize("shrinking", [CAPPED, EACH])
@pytest.mark.parametrize(("workers", "seed"), [(1, 1), (2, 2), (2, 3), (5, 4)])
def test_workers_and_durations_change_no_flight(
    tmp_path: Path,
    undisturbed: dict[bool, tuple[Results, set[str]]],
    shrinking: ShrinkBudget,
    workers: int,
    seed: int,
) -> None:
    path = tmp_path / "ledger.sqlite"
    results = Session(path, shrinking, workers, seed).run()
    assert (results, flights(path)) == undisturbed[shrinking.capped]


@pytest.mark.parametrize("turns", [3, 17, 30, 45, 60])
def test_interrupted_run_goes_on_with_the_same_flights(
    tmp_path: Path, undisturbed: dict[bool, tuple[Results, set[str]]], turns: int
) -> None:
    path = tmp_path / "ledger.sqlite"
    left = iter(range(turns))

    def interrupt() -> None:
        if next(left, None) is None:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Session(path, CAPPED, workers=2, seed=turns).run(interrupt)
    resumed = Session(path, CAPPED, workers=2)
    assert (resumed.run(), flights(path)) == undisturbed[True]


def test_cap_gives_all_flights_in_the_order_of_discovery(
    undisturbed: dict[bool, tuple[Results, set[str]]],
) -> None:
    results, _ = undisturbed[True]
    flown = {name: each.flights for name, each in results.items()}
    assert sum(flown.values()) <= WANTED
    assert flown["search off:of-fog"]
    assert flown["search off:of-rain"]
    everything, _ = undisturbed[False]
    assert all(each.flights and each.case for each in everything.values())
    assert len(everything) == 4


def test_investigation_flies_while_the_search_goes_on(tmp_path: Path) -> None:
    session = Session(tmp_path / "ledger.sqlite", EACH, workers=2, seed=1)
    session.run()
    last = max(number for number, each in enumerate(session.flown) if each == "search")
    assert "beside" in session.flown[:last]


def test_search_flies_before_investigations_until_these_would_take_longer(tmp_path: Path) -> None:
    session = Session(tmp_path / "ledger.sqlite", EACH)
    session.run()
    # One worker never waits for the others' last flights of a generation.
    first = session.flown.index("beside")
    assert len(GENERATIONS[0]) < first < WANTED
    assert WANTED - first <= EACH.each


def test_error_of_an_investigation_ends_the_run_after_the_search(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> CaseResult:
        raise ZeroDivisionError("no case")

    monkeypatch.setattr("pytest_garl.triage.investigation_queue.build_case", fails)
    session = Session(tmp_path / "ledger.sqlite", EACH)
    with pytest.raises(ZeroDivisionError, match="no case"):
        session.run()
    assert session.flown.count("search") == WANTED
