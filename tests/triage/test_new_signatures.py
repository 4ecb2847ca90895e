from __future__ import annotations

from pathlib import Path

import pytest

from pytest_garl.execution.ledger import Ledger
from pytest_garl.triage.new_signatures import NewSignatures
from tests.cases.running_search import NOTHING_UNUSUAL, RunningSearch, corpus_of

FOG, RAIN, SNOW = "off:of-fog", "off:of-rain", "off:of-snow"


@pytest.fixture
def search(tmp_path: Path) -> RunningSearch:
    return RunningSearch(Ledger.create(tmp_path / "ledger.sqlite", {}))


def names(search: RunningSearch, found: NewSignatures) -> list[tuple[str, int]]:
    """Return signature and number of violations of the requests that are new."""
    return [(each.signature, len(each.violations)) for each in found.advance()]


def test_signature_is_found_when_its_generation_is_flown(search: RunningSearch) -> None:
    found = NewSignatures(search.ledger, corpus_of(), 12)
    search.add_generation(0, ["fog", "", "rain", "fog"])
    search.fly((0, 0), (0, 2), (0, 3))
    assert names(search, found) == []
    search.fly((0, 1))
    assert names(search, found) == [(FOG, 2), (RAIN, 1)]
    assert names(search, found) == []


def test_requests_begin_with_the_lowest_slot(search: RunningSearch) -> None:
    found = NewSignatures(search.ledger, corpus_of(), 12)
    search.add_generation(0, ["", "fog", "fog"])
    search.fly((0, 2), (0, 1), (0, 0))
    (request,) = found.advance()
    assert request.scenarios[0] == search.scenario(0, 1)
    assert (request.name, request.budget) == (f"search {FOG}", 12)


def test_later_generation_adds_no_violations_of_a_known_signature(search: RunningSearch) -> None:
    found = NewSignatures(search.ledger, corpus_of(), 12)
    search.add_generation(0, ["fog"])
    search.add_generation(1, ["fog", "rain"])
    search.fly((1, 0), (1, 1))
    # Generation 1 is over, but generation 0 is not.
    assert names(search, found) == []
    search.fly((0, 0))
    assert names(search, found) == [(FOG, 1), (RAIN, 1)]


def test_saved_case_is_asked_once_so_that_a_resumed_run_finds_the_same(
    search: RunningSearch,
) -> None:
    search.add_generation(0, ["fog", "rain"])
    search.fly((0, 0), (0, 1))
    assert names(search, NewSignatures(search.ledger, corpus_of(FOG), 12)) == [(RAIN, 1)]
    resumed = NewSignatures(search.ledger, corpus_of(FOG, RAIN), 12)
    assert names(search, resumed) == [(RAIN, 1)]


def test_violation_in_which_the_known_cause_is_nominal_is_new(search: RunningSearch) -> None:
    foggy = NOTHING_UNUSUAL.replace({"environment.fog": 0.1})
    rainy = NOTHING_UNUSUAL.replace({"environment.rain": 0.1})
    search.add_generation(0, ["rain"])
    search.fly((0, 0))
    known = NewSignatures(search.ledger, corpus_of(RAIN, scenario=rainy), 12)
    assert names(search, known) == []
    (search.ledger.path.parent / "other").mkdir()
    other = RunningSearch(Ledger.create(search.ledger.path.parent / "other" / "ledger.sqlite", {}))
    other.add_generation(0, ["rain"])
    other.fly((0, 0))
    assert names(other, NewSignatures(other.ledger, corpus_of(RAIN, scenario=foggy), 12)) == [
        (RAIN, 1)
    ]
