"""The fault suite: its scenarios, its definition, its report."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lab.faults import search
from lab.faults.catalogue import FAULTS, fault_named
from lab.faults.control import ControlSystem
from lab.faults.fault import SCENARIOS, Fault, finds, result_of
from lab.faults.report import mean_text, ratio_interval, report
from lab.faults.search import DOMAIN, npcs, search_for
from pytest_garl.scenarios.chromosome import decode, encode
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.files import dumps
from pytest_garl.scenarios.genes import MOST_ACTIVE, ON_ABOVE, Genome
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import problems, repair
from pytest_garl.search.columns import Columns
from tests.support.results import flight_result

NAMES = [each.name for each in FAULTS]


def place_of(fault: Fault) -> tuple[Map, Genome]:
    map = load_map(fault.map)
    return map, genome_of(DOMAIN, map)


def nominal(map_name: str) -> Scenario:
    """Return the scenario of the domain in which nothing acts, with the pad in the middle."""
    map = load_map(map_name)
    genome = genome_of(DOMAIN, map)
    row = [item.nominal for gene in genome.genes for item in gene.properties]
    scenario = decode(np.array(row), genome, map=map_name, seed=1)
    return repair(scenario.replace({"marker.x": 0.0, "marker.y": 0.0}), map)


def test_there_are_at_least_24_faults_with_names_links_and_scenarios_of_their_own() -> None:
    assert len(FAULTS) >= 24
    assert len({*NAMES}) == len({each.faulty for each in FAULTS}) == len(FAULTS)
    assert {path.stem for path in SCENARIOS.glob("*.toml")} == {*NAMES}
    assert all(each.links and each.faulty.__doc__ for each in FAULTS)


@pytest.mark.parametrize("name", NAMES)
def test_a_scenario_lies_inside_field_and_its_genome_expresses_it(name: str) -> None:
    fault = fault_named(name)
    scenario, (map, genome) = fault.scenario, place_of(fault)
    assert scenario.map == fault.map
    assert not problems(scenario, map)
    assert not DOMAIN.outside(scenario, map)
    vector = encode(scenario, genome)
    assert decode(vector, genome, map=fault.map, seed=scenario.seed) == scenario
    row = dict(zip(genome.keys, vector, strict=True))
    optional = [gene for gene in genome.genes if gene.is_optional]
    active = [gene.name for gene in optional if row[gene.properties[0].key] > ON_ABOVE]
    assert len(active) <= MOST_ACTIVE, active


@pytest.mark.sim
@pytest.mark.parametrize(
    "name",
    [pytest.param(each, marks=() if each == "gain" else pytest.mark.long) for each in NAMES],
)
def test_a_scenario_fires_its_fault_and_no_fault_of_the_control(name: str) -> None:
    fault = fault_named(name)
    faulty = result_of(fault.faulty, fault.scenario, npcs())
    assert faulty.verdict.violation_type == fault.fires, faulty.verdict.story
    assert finds(fault, fault.scenario, npcs(), faulty)


@pytest.mark.sim
@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_a_faulty_system_lands_in_the_nominal_scenario(name: str) -> None:
    fault = fault_named(name)
    verdict = result_of(fault.faulty, nominal(fault.map), npcs()).verdict
    assert verdict.completed, verdict.story


@pytest.mark.sim
@pytest.mark.parametrize("map_name", ["court", "lawn"])
def test_the_control_lands_in_the_nominal_scenario(map_name: str) -> None:
    assert result_of(ControlSystem, nominal(map_name), npcs()).verdict.completed


def failing(system: object, scenario: Scenario, policy: object) -> object:
    """Fail in half of the scenarios, whoever flies."""
    if scenario.seed % 2:
        return flight_result("off", primary="distance")
    return flight_result()


def failing_if_faulty(system: object, scenario: Scenario, policy: object) -> object:
    """Fail with the faulty system, in one scenario of eight."""
    fails = system is not ControlSystem and scenario.seed % 8 == 0
    return flight_result("off", primary="distance") if fails else flight_result()


@pytest.mark.parametrize("method", ["random", "garl"])
def test_a_control_compared_with_itself_is_never_found(
    method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(search, "result_of", failing)
    monkeypatch.setattr("lab.faults.fault.result_of", failing)
    null = Fault(
        name="null", family="none", links=(), summary="no fault", faulty=ControlSystem, fires="off"
    )
    assert search_for(null, method, 0, 30).found_at is None


@pytest.mark.parametrize("method", ["random", "garl"])
def test_a_search_ends_at_its_first_find(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    flown: list[Scenario] = []

    def flying(system: object, scenario: Scenario, policy: object) -> object:
        if system is not ControlSystem:
            flown.append(scenario)
        return failing_if_faulty(system, scenario, policy)

    monkeypatch.setattr(search, "result_of", flying)
    monkeypatch.setattr("lab.faults.fault.result_of", flying)
    found = search_for(fault_named("gate"), method, 3, 60)
    assert found.found_at == found.flights == len(flown)
    assert 0 <= found.acted <= found.flights
    assert found.masked == 0
    assert [each.seed % 8 == 0 for each in flown].index(True) == len(flown) - 1


def test_what_fires_a_fault_is_counted_by_its_kind() -> None:
    columns = Columns(genome_of(DOMAIN, load_map("lawn")))
    assert search.acting(fault_named("mean").scenario, columns) == {"jump"}
    assert search.acting(fault_named("unfresh").scenario, columns) == {"jump", "outage"}
    assert search.acting(fault_named("no-margin").scenario, columns) == {"decoy", "told"}


def rows(
    method: str, found: dict[str, list[int | None]], acted: str = "", masked: str = ""
) -> list[dict[str, str]]:
    return [
        {
            "method": method,
            "fault": fault,
            "seed": str(seed),
            "found_at": str(at or ""),
            "acted": acted,
            "masked": masked,
            "flights": str(at or 100),
        }
        for fault, seeds in found.items()
        for seed, at in enumerate(seeds)
    ]


def test_the_report_says_how_often_what_fires_a_missed_fault_acted() -> None:
    text = report(rows("garl", {"gate": [50, None, None]}, acted="7", masked="12"))
    assert (
        "gate (1 of 3; all that acts in its scenario acted in 7 % of flights, 12 % masked)" in text
    )


def test_the_report_counts_misses_as_100_flights_and_names_them() -> None:
    text = report(
        [
            *rows("random", {"gate": [50, None], "mean": [100, 100]}),
            *rows("garl", {"gate": [25, 25], "mean": [50, 50]}),
        ]
    )
    assert "| garl | 2 | 2 | 50 % [50, 50] | 100 % [100, 100] | 100 % [100, 100] |" in text
    assert "| all | 2 | 0.43 [0.33, 0.50] |" in text
    assert "Not found by random in every seed: gate (1 of 2)." in text
    assert "random finds 0 of 2 faults in under half of the seeds: none." in text


def test_the_placebo_counts_in_no_score() -> None:
    text = report(
        [
            *rows("random", {"gate": [50, 50], "placebo": [None, None]}),
            *rows("garl", {"gate": [25, 25], "placebo": [7, None]}),
        ]
    )
    assert "| garl | 1 | 2 |" in text
    assert "chance found the placebo: garl in 1 of 2, random in 0 of 2." in text


def test_a_seed_that_is_not_wholly_flown_does_not_count() -> None:
    text = report(rows("garl", {"gate": [25, 25], "mean": [None]}))
    assert "| garl | 2 | 1 | 50 % | 50 % | 50 % |" in text
    assert text.endswith("Not counted, because not all faults are flown: seed 1 of garl.")
    assert "Not counted" not in report(rows("garl", {"gate": [25, 25]}))


def test_equal_methods_have_a_ratio_of_one() -> None:
    flights = np.array([3.0, 100.0, 40.0])
    assert ratio_interval(flights, flights) == (1.0, 1.0, 1.0)


def test_one_seed_has_no_interval() -> None:
    assert mean_text([0.5]) == "50 %"


def test_the_page_lists_every_fault_with_its_links() -> None:
    page = Path("docs/faults.md").read_text()
    for fault in FAULTS:
        assert f"| `{fault.name}` |" in page
        assert all(link in page for link in fault.links)


def test_the_files_are_written_as_the_package_writes_them() -> None:
    for fault in FAULTS:
        text = fault.file.read_text()
        written = dumps(fault.scenario, load_map(fault.map))
        assert text.partition("schema")[2] == written.partition("schema")[2], fault.name
