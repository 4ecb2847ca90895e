"""The progress of a run in one line."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import cast

import pytest

from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import FlightSeconds, SearchProgress
from pytest_garl.plugin.session.run import Run
from pytest_garl.plugin.terminal import progress
from pytest_garl.plugin.terminal.progress import ProgressReader, RunProgress, progress_line
from pytest_garl.plugin.terminal.time_left import FIRST_FLIGHTS, NewKinds
from pytest_garl.triage.forecast import RemainingWork, flights_after_search

TWO = (
    SearchProgress(search="s", system="m:A", map="court", flown=3, total=4, generation=1),
    SearchProgress(search="s", system="m:A", map="lawn", flown=1, total=4, generation=0),
)


PROGRESS = RunProgress(
    searches=TWO,
    kinds={"I": 2, "IV": 1},
    nearest={"time": (90.3, "s"), "collision": (0.25, "m"), "crash": (1.0, "1")},
    flights_per_s=0.5,
    expected_after=8.0,
    left_s=24.0,
)


def test_line_tells_the_flights_that_shrink_from_those_of_the_search() -> None:
    assert progress_line(PROGRESS, 160) == (
        "garl [#####---------------]  4/8 flights, shrinking 0/~8  24 s left  I:2 IV:1  "
        "A on court g01 3/4  0.50 flights/s  nearest collision 0.25 m, time 90 s"
    )
    more = dataclasses.replace(PROGRESS, selected=40)
    assert "4/40 flights, shrinking 0/~8" in progress_line(more, 160)
    new = RunProgress(searches=TWO[1:], kinds={}, nearest={})
    assert progress_line(new, 160) == "garl [#####---------------]  1/4 flights  A on lawn g00 1/4"


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def monotonic(self) -> float:
        return self.now


@dataclasses.dataclass
class Flown:
    """What a ledger says of a run with one search, as far as its progress asks."""

    flown: int = 0
    beside: int = 0
    kinds: int = 0
    flight_s: float = 2.0
    wanted: int = 40

    def progress(self) -> list[SearchProgress]:
        return [
            SearchProgress(
                search="s",
                system="m:A",
                map="lawn",
                flown=self.flown,
                total=self.wanted,
                generation=0,
            )
        ]

    def meters(self) -> dict[str, float]:
        flights = self.flown + self.beside
        return {"on_demand": self.beside, "flying_s": flights * self.flight_s}

    def seconds_by_signature(self) -> dict[tuple[str, str], float]:
        return {("search", f"I:{number}"): 1.0 for number in range(self.kinds)}

    def flight_seconds(self) -> FlightSeconds:
        count = self.kinds + self.beside
        return FlightSeconds(
            of_search=self.flight_s,
            plain=self.flight_s,
            failing=self.flight_s,
            failing_count=count,
        )

    violation_counts = nearest = dict


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(progress, "time", clock)
    monkeypatch.setattr(NewKinds, "_known_in", lambda *args: frozenset())
    return clock


def reader_of(workers: int, remaining: RemainingWork | None = None) -> ProgressReader:
    options = SimpleNamespace(shrink=12, shrink_capped=True, budget=40, workers=workers)
    run = SimpleNamespace(remaining=remaining, investigations=None, options=options)
    return ProgressReader(cast(Run, run), 1.0)


def read(reader: ProgressReader, queries: Flown) -> RunProgress:
    found = reader.read(
        cast(Ledger, SimpleNamespace(queries=queries, facts=SimpleNamespace(selected=0)))
    )
    assert found is not None
    return found


def test_rate_counts_what_was_flown_since_the_first_reading(clock: Clock) -> None:
    """A reader may begin with a run that is half over, or with a ledger that a run continues."""
    reader = reader_of(1, RemainingWork(at_most=0, flights=0.0, seconds=0.0))
    reader.start_clock()
    clock.now += 30.0
    assert read(reader, Flown(flown=20)).flights_per_s is None
    clock.now += 30.0
    assert read(reader, Flown(flown=23)).flights_per_s == pytest.approx(0.1)


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("kinds_in_all", [0, 2, 5, 9])
@pytest.mark.parametrize("slower", [0.7, 1.0, 1.4])
def test_time_left_is_right_within_a_factor_of_two_and_the_bar_never_goes_back(
    clock: Clock, workers: int, kinds_in_all: int, slower: float
) -> None:
    """A search of 40 flights finds kinds as a collector does, and shrinks them after it.

    Its first eight flights take ``slower`` as long as the others.
    """
    reader, told, beside = reader_of(workers), [], 0
    after = flights_after_search(kinds_in_all, 12, 40)
    shares = []
    for number in range(1, 81):
        flown = min(40, number)
        beside = max(0, number - 40)
        if beside > after:
            break
        flight_s = 4.0 * (slower if flown <= 8 else 1.0)
        clock.now += flight_s / workers
        mean_s = 4.0 * (slower * min(flown, 8) + max(0, flown - 8)) / flown
        kinds = round(kinds_in_all * (flown / 40) ** 0.6)
        found = read(reader, Flown(flown=flown, beside=beside, kinds=kinds, flight_s=mean_s))
        shares.append(found.share)
        assert (found.left_s is None) == (number < FIRST_FLIGHTS)
        if found.left_s is not None and number <= 30:
            left = (40 - flown + after) * 4.0 / workers
            told.append(found.left_s / left)
    assert min(told) >= 0.5
    assert max(told) <= 2.0
    assert shares == sorted(shares)


def test_time_left_after_the_search_follows_the_flights_that_shrink(clock: Clock) -> None:
    reader = reader_of(2, RemainingWork(at_most=30, flights=20.0, seconds=40.0))
    assert read(reader, Flown(flown=40)).left_s == 40.0
    clock.now += 30.0
    assert read(reader, Flown(flown=40, beside=2)).left_s == 10.0
    clock.now += 30.0
    # Ten flights took a minute, so that the other ten take another one.
    assert read(reader, Flown(flown=40, beside=10)).left_s == 60.0
    # Other causes take flights that nobody has planned.
    clock.now += 30.0
    assert read(reader, Flown(flown=40, beside=20)).left_s is None


def test_line_says_that_kinds_are_shrunk_beside_the_search() -> None:
    both = dataclasses.replace(PROGRESS, investigated=2)
    assert "A on court g01 3/4  shrinking 2 kinds beside it  0.50 flights/s" in progress_line(
        both, 200
    )


def test_line_of_a_run_that_does_not_shrink_speaks_of_repeating_only() -> None:
    repeating = dataclasses.replace(PROGRESS, shrinks=False, flown_after=3.0, expected_after=4.0)
    line = progress_line(repeating, 200)
    assert "4/8 flights, repeating 3/~4" in line
    done = SearchProgress(search="s", system="m:A", map="court", flown=8, total=8, generation=1)
    ended = dataclasses.replace(repeating, searches=[done], left_s=3.0, after_search=True)
    assert progress_line(ended, 200).startswith(
        "garl [##################--]  8/8 flights, repeating 3/~4  3 s left  I:2 IV:1  repeating  "
    )


@pytest.mark.parametrize("width", range(20, 160, 7))
def test_narrow_terminal_gets_whole_phrases(width: int) -> None:
    line = progress_line(PROGRESS, width)
    assert len(line) <= max(width, len("garl [##--------]"))
    assert {*line.split("  ")[1:]} <= {*PROGRESS.phrases}
    if width >= 80:
        assert "garl [##--------]  4/8 flights, shrinking 0/~8  24 s left" in line or width >= 100


def test_line_follows_the_forecast_once_there_is_one() -> None:
    done = SearchProgress(search="s", system="m:A", map="court", flown=4, total=4, generation=0)
    shrinking = RunProgress(
        searches=[done],
        kinds={"IV": 3},
        nearest={},
        flown_after=2,
        expected_after=12,
        left_s=33,
        after_search=True,
    )
    assert progress_line(shrinking, 99) == (
        "garl [###-------]  4/4 flights, shrinking 2/~12  33 s left  IV:3  confirming and shrinking"
    )
