"""A search whose directors learn has the same bytes for any number of workers, and after a kill."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from pytest_garl.execution.ledger_queue import Claim
from pytest_garl.npcs.director_progress import AND_EVENTS
from pytest_garl.npcs.event_lessons import rule_network
from tests.search.learned_search import SIZE, Run, Searched


def by_one_worker(folder: Path) -> Searched:
    run = Run(folder)
    run.fly()
    return run.end()


def by_two_workers(folder: Path) -> Searched:
    """Two slots fly at once, and the later one is the first to land."""
    run = Run(folder)
    flying: list[Claim] = []
    for claim in run.claims():
        flying.append(claim)
        if len(flying) == 2:
            run.record(flying.pop())
        if run.ledger.queue.waiting() == 0:
            while flying:
                run.record(flying.pop())
    return run.end()


def after_kills(folder: Path) -> Searched:
    """Kill the processes in the middle of two generations, while a slot flies."""
    for stops in (5, SIZE + 3, None):
        run = Run(folder)
        for claim in run.claims():
            if run.ledger.queries.meters().get("flights", 0) == stops:
                break
            run.record(claim)
        found = run.end()
    return found


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Searched:
    return by_one_worker(tmp_path_factory.mktemp("undisturbed"))


def test_both_directors_learn_in_the_search_that_is_compared(undisturbed: Searched) -> None:
    # Else the other tests would compare what ships with what ships.
    control, *learned = undisturbed.weights
    assert control == ""
    npcs, events = zip(*(text.split(AND_EVENTS) for text in learned), strict=True)
    assert len({*npcs}) == len({*events}) == 2, "the second and the third learned from the control"
    assert rule_network().text not in events
    decided = Counter(key for each in undisturbed.decided for key, _ in each)
    assert decided["jump.from_s"] > 0 < decided["outage.from_s"]
    first, second, *others = undisturbed.progress
    assert first.events.struck > 0 < second.events.struck
    assert first.npcs.npcs > 0
    assert others == [None, None], "nothing learns from the last generations"


@pytest.mark.parametrize("fly", [by_two_workers, after_kills])
def test_results_and_weights_of_both_directors_are_the_same(
    tmp_path: Path, undisturbed: Searched, fly: Callable[[Path], Searched]
) -> None:
    assert fly(tmp_path) == undisturbed
