"""The fault suite: its scenarios and its definition."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lab.arms import DOMAIN
from lab.faults.catalogue import FAULTS, fault_named
from lab.faults.control import ControlSystem
from lab.faults.fault import SCENARIOS, Fault
from lab.judges.faults import violates
from lab.one_search import flown_by
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.chromosome import decode, encode
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.files import dumps
from pytest_garl.scenarios.genes import MOST_ACTIVE, ON_ABOVE, Genome
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import problems, repair

NAMES = [each.name for each in FAULTS]
NPCS = policy_spec("graded")


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
    faulty = flown_by(fault.faulty, NPCS, fault.scenario).result
    assert faulty.verdict.violation_type == fault.fires, faulty.verdict.story
    assert not violates(fault.control, NPCS, fault.scenario)


@pytest.mark.sim
@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_a_faulty_system_lands_in_the_nominal_scenario(name: str) -> None:
    fault = fault_named(name)
    verdict = flown_by(fault.faulty, NPCS, nominal(fault.map)).result.verdict
    assert verdict.completed, verdict.story


@pytest.mark.sim
@pytest.mark.parametrize("map_name", ["court", "lawn"])
def test_the_control_lands_in_the_nominal_scenario(map_name: str) -> None:
    assert flown_by(ControlSystem, NPCS, nominal(map_name)).result.verdict.completed


def test_the_page_lists_every_fault_with_its_links() -> None:
    page = Path("docs/results/faults.md").read_text()
    for fault in FAULTS:
        assert f"| `{fault.name}` |" in page
        assert all(link in page for link in fault.links)


def test_the_files_are_written_as_the_package_writes_them() -> None:
    for fault in FAULTS:
        text = fault.file.read_text()
        written = dumps(fault.scenario, load_map(fault.map))
        assert text.partition("schema")[2] == written.partition("schema")[2], fault.name
