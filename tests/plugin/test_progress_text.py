"""The progress of a run in one line."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import cast

import pytest

from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import SearchProgress
from pytest_garl.plugin import progress_text
from pytest_garl.plugin.progress_text import ProgressReader, RunProgress, progress_line
from pytest_garl.plugin.run import Run
from pytest_garl.regressions.forecast import RemainingWork

TWO = (
    SearchProgress(system="m:A", map="court", flown=3, total=4, generation=1),
    SearchProgress(system="m:A", map="lawn", flown=1, total=4, generation=0),
)


PROGRESS = RunProgress(
    searches=TWO,
    kinds={"I": 2, "IV": 1},
    nearest={"time": (90.3, "s"), "collision": (0.25, "m"), "crash": (1.0, "1")},
    seconds=8.0,
    expected_after=8.0,
)


def test_line_tells_the_flights_that_shrink_from_those_of_the_search() -> None:
    assert progress_line(PROGRESS, 160) == (
        "garl [#####---------------]  4/8 flights, 0/8 to shrink  24 s left  I:2 IV:1  "
        "A on court g01 3/4  0.50 flights/s  nearest collision 0.25 m, time 90 s"
    )
    more = dataclasses.replace(PROGRESS, selected=40)
    assert "4/40 flights, 0/8 to shrink" in progress_line(more, 160)
    new = RunProgress(searches=TWO[1:], kinds={}, nearest={}, seconds=0.0)
    assert progress_line(new, 160) == "garl [#####---------------]  1/4 flights  A on lawn g00 1/4"


def test_first_log_line_counts_the_time_before_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = [100.0]
    monkeypatch.setattr(progress_text, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    reader = ProgressReader(
        cast(
            Run,
            SimpleNamespace(
                remaining=RemainingWork(at_most=0, flights=0.0, seconds=0.0),
                investigations=None,
                options=SimpleNamespace(shrink=20),
            ),
        ),
        30.0,
    )
    reader.start_clock()
    clock[0] += 30.0
    queries = SimpleNamespace(
        progress=lambda: [TWO[1]], meters=dict, violation_counts=dict, nearest=dict
    )
    ledger = SimpleNamespace(queries=queries, fact=lambda key: None)
    found = reader.read(cast(Ledger, ledger))
    assert found is not None
    assert found.seconds == 30.0


def test_line_says_that_kinds_are_shrunk_beside_the_search() -> None:
    both = dataclasses.replace(PROGRESS, investigated=2)
    assert "A on court g01 3/4  shrinking 2 kinds beside it  0.50 flights/s" in progress_line(
        both, 200
    )


def test_line_of_a_run_that_does_not_shrink_speaks_of_repeating_only() -> None:
    repeating = dataclasses.replace(PROGRESS, shrinks=False, flown_after=3.0, expected_after=4.0)
    line = progress_line(repeating, 200)
    assert "4/8 flights, 3/4 to repeat" in line
    done = SearchProgress(system="m:A", map="court", flown=8, total=8, generation=1)
    ended = dataclasses.replace(repeating, searches=[done], left_s=3.0)
    assert progress_line(ended, 200).startswith(
        "garl [##################--]  8/8 flights, 3/4 to repeat  3 s left  I:2 IV:1  repeating  "
    )


@pytest.mark.parametrize("width", range(20, 160, 7))
def test_narrow_terminal_gets_whole_phrases(width: int) -> None:
    line = progress_line(PROGRESS, width)
    assert len(line) <= max(width, len("garl [##--------]"))
    assert {*line.split("  ")[1:]} <= {*PROGRESS.phrases}
    if width >= 80:
        assert "garl [##--------]  4/8 flights, 0/8 to shrink  24 s left" in line or width >= 100


def test_line_follows_the_forecast_once_there_is_one() -> None:
    done = SearchProgress(system="m:A", map="court", flown=4, total=4, generation=0)
    shrinking = RunProgress(
        searches=[done],
        kinds={"IV": 3},
        nearest={},
        seconds=8.0,
        flown_after=2,
        expected_after=12,
        left_s=33,
    )
    assert progress_line(shrinking, 99) == (
        "garl [###-------]  4/4 flights, 2/12 to shrink  33 s left  IV:3  confirming and shrinking"
    )
