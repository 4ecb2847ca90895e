from __future__ import annotations

import dataclasses
import gzip
import json
from collections.abc import Sequence
from pathlib import Path

import pytest

from lab.stand_in import stand_in
from pytest_garl.errors import ArchiveError
from pytest_garl.scenarios.chromosome import encode
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.archive import (
    LEAST_OF_A_KIND,
    MOST_SUSPECTS,
    Archive,
    ArchivedFlight,
    ArchivedSearch,
    read_archive,
)
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.search.methods.garl import Garl
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.search.model import MOST_FLIGHTS
from tests.support.results import flight_result

MAP = load_map("court")
GENOME = genome_of(domain_named("field"), MAP)
CALM = genome_of(domain_named("calm"), MAP)
PLAN = SearchPlan(map=MAP, genome=GENOME, seed=1, flights=100, population=20)


def flights(
    count: int, signatures: Sequence[str] = (), seed: int = 0
) -> tuple[ArchivedFlight, ...]:
    """Return random flights that end as the stand-in does, or with these signatures in turn."""
    scenarios = random_scenarios(MAP, GENOME, seed, 0, count)
    return tuple(
        ArchivedFlight(
            scenario=dump_scenario(each),
            result=flight_result(signatures[place % len(signatures)])
            if signatures
            else stand_in(each, MAP),
        )
        for place, each in enumerate(scenarios)
    )


def search(own: tuple[ArchivedFlight, ...], name: str = "a", flown_by: str = "1") -> ArchivedSearch:
    return ArchivedSearch(search=name, system="m:C", map="court", flown_by=flown_by, flights=own)


def archive(*searches: ArchivedSearch) -> Archive:
    return Archive(searches=searches)


def test_what_is_written_is_read_again_with_the_same_hash(tmp_path: Path) -> None:
    written = archive(search(flights(8)))
    file = tmp_path / "folder" / "night.archive"
    written.save(file)
    first = file.read_bytes()
    assert read_archive(file) == written
    assert read_archive(file).sha256 == written.sha256
    written.save(file)
    assert file.read_bytes() == first


def test_the_same_search_knows_the_flights() -> None:
    own = flights(8)
    found = archive(search(own)).knowledge("a", "1", GENOME, MAP)
    assert [dump_scenario(each.scenario) for each in found.known] == [each.scenario for each in own]
    assert [each.result for each in found.known] == [each.result for each in own]
    assert not found.suspects


@pytest.mark.parametrize(("name", "flown_by"), [("a", "2"), ("b", "1")])
def test_another_search_flies_a_scenario_of_each_kind_again(name: str, flown_by: str) -> None:
    own = flights(12, ["", "I", "", "off"])
    found = archive(search(own)).knowledge(name, flown_by, GENOME, MAP)
    assert not found.known
    assert [dump_scenario(each) for each in found.suspects] == [own[11].scenario, own[9].scenario]


def test_a_search_flies_no_more_again_than_a_few() -> None:
    own = flights(3 * MOST_SUSPECTS, [f"kind-{number}" for number in range(3 * MOST_SUSPECTS)])
    found = archive(search(own)).knowledge("b", "1", GENOME, MAP)
    assert len(found.suspects) == MOST_SUSPECTS


def test_what_lies_outside_of_the_domain_or_on_another_map_is_not_flown() -> None:
    own = flights(30, ["I"])
    inside = archive(search(own)).knowledge("b", "1", CALM, MAP).suspects
    for each in inside:
        encode(each, CALM)
    assert len(inside) <= 1
    lawn = dataclasses.replace(search(own), map="lawn")
    assert archive(lawn).knowledge("b", "1", GENOME, MAP).suspects == ()


def test_an_archive_keeps_the_latest_flights_and_some_of_each_kind() -> None:
    rare, frequent = flights(7, ["rare"]), flights(MOST_FLIGHTS, ["", "often"], seed=1)
    kept = search(frequent).after(search(rare)).flights
    assert len(kept) == MOST_FLIGHTS
    assert [each for each in kept if each.result.signature == "rare"] == [*rare[-LEAST_OF_A_KIND:]]
    late = [each for each in kept if each.result.signature != "rare"]
    assert late == [*frequent[-len(late) :]]


def test_flights_of_other_code_are_not_kept() -> None:
    old, new = flights(4), flights(4, seed=1)
    assert search(new, flown_by="2").after(search(old)).flights == new
    assert search(new).after(search(old)).flights == (*old, *new)
    assert search(old).after(search(old)).flights == old


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"no gzip", "this archive is damaged"),
        (gzip.compress(b"{"), "this archive is damaged: not valid JSON"),
        (gzip.compress(b"[1]"), "this is no archive of pytest-garl"),
        (gzip.compress(b'{"format": "pytest-garl-archive", "version": 7}'), "found version 7"),
        (gzip.compress(b"{}")[:-9], "this archive ends too early"),
        (
            gzip.compress(
                b'{"format": "pytest-garl-archive", "version": 1, "searches": [{"map": 1}]}'
            ),
            r"damaged: searches\[0\]",
        ),
    ],
    # Not the bytes, which hold the time: all processes collect the same names.
    ids=["no-gzip", "no-json", "no-object", "version", "short", "search"],
)
def test_a_file_that_is_no_archive_is_refused(tmp_path: Path, content: bytes, says: str) -> None:
    file = tmp_path / "it"
    file.write_bytes(content)
    with pytest.raises(ArchiveError, match=f"^{file}: .*{says}.*Remove it: the next search"):
        read_archive(file)


def test_what_would_fill_the_memory_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "it"
    file.write_bytes(gzip.compress(b" " * 3000))
    monkeypatch.setattr("pytest_garl.search.archive.LARGEST_TEXT", 2000)
    with pytest.raises(ArchiveError, match="holds more than 2000 bytes of text"):
        read_archive(file)
    monkeypatch.setattr("pytest_garl.search.archive.LARGEST_FILE", 20)
    with pytest.raises(ArchiveError, match=r"expected at most 20\. Remove it"):
        read_archive(file)
    with pytest.raises(ArchiveError, match="found a folder"):
        read_archive(tmp_path)


def test_a_scenario_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    file = tmp_path / "it"
    values = json.loads(archive(search(flights(1))).text)
    values["searches"][0]["flights"][0]["scenario"] = "nothing"
    file.write_bytes(gzip.compress(json.dumps(values).encode()))
    with pytest.raises(ArchiveError, match="this archive is damaged"):
        read_archive(file)


Made = list[list[Scenario]]


def night(plan: SearchPlan, generations: int = 5) -> tuple[Made, list[str], list[FlownScenario]]:
    """Return the generations of a search, how each scenario was made, and all flights."""
    method, made, hows, flown = Garl(plan), Made(), list[str](), list[FlownScenario]()
    for _ in range(generations):
        scenarios = list(method.ask())
        made.append(scenarios)
        hows += [f"{each.how} {' '.join(each.parents)}" for each in method.origins]
        own = [FlownScenario(scenario=each, result=stand_in(each, MAP)) for each in scenarios]
        method.tell(own)
        flown += own
    return made, hows, flown


def test_children_have_parents_of_an_earlier_night_and_the_control_stays_random() -> None:
    _, _, first = night(dataclasses.replace(PLAN, seed=0))
    known = dataclasses.replace(PLAN, known=tuple(first))
    made, hows, _ = night(known)
    plain, _, _ = night(PLAN)
    assert made[0] == plain[0]
    assert made[1] != plain[1]
    # The first children know 40 flights of their night, and the 100 of the archive.
    own = [how for how in hows[60:80] if how.startswith("bred")]
    assert sum("archived-" in how for how in own) > len(own) / 2
    texts = [dump_scenario(each.scenario) for each in first]
    assert not {dump_scenario(each) for generation in made[1:] for each in generation} & {*texts}
    assert night(known)[0] == made


def test_a_named_parent_gave_the_child_a_condition() -> None:
    _, _, first = night(dataclasses.replace(PLAN, seed=0))
    method = Garl(dataclasses.replace(PLAN, known=tuple(first), flights=40))
    control = method.ask()
    method.tell([FlownScenario(scenario=each, result=stand_in(each, MAP)) for each in control])
    made = [*zip(method.ask(), method.origins, strict=True)]
    assert sum(origin.how == "bred" for _, origin in made) == 10
    for child, origin in made:
        for parent in origin.parents:
            kind, _, number = parent.partition("-")
            other = first[int(number)].scenario if kind == "archived" else control[int(parent[-2:])]
            assert {*child.genes} & {*other.genes}


def test_suspects_are_flown_once_in_places_of_stratified_scenarios() -> None:
    suspects = tuple(random_scenarios(MAP, GENOME, 99, 0, 7))
    made, hows, _ = night(dataclasses.replace(PLAN, suspects=suspects))
    replayed = [place for place, how in enumerate(hows) if how.startswith("replayed")]
    assert [place // 20 for place in replayed] == [1, 1, 1, 1, 1, 2, 2]
    assert [made[place // 20][place % 20] for place in replayed] == [*suspects]
    assert [how.startswith("bred") for how in hows] == [False] * 60 + [True] * 40
