"""Domains: what their files say, what is drawn from them, what lies outside."""

from __future__ import annotations

import dataclasses
import tomllib
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.chromosome import decode, encode
from pytest_garl.scenarios.domains import domain_file
from pytest_garl.scenarios.domains.domain import CONDITIONS, Domain
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.domains.names import BUILT_IN
from pytest_garl.scenarios.files import dumps, loads
from pytest_garl.scenarios.genes import Genome, active_genes, genome_for
from pytest_garl.scenarios.genome_like import with_destinations
from pytest_garl.scenarios.groups import EVENT_MOMENTS, EVENTS, GROUPS, MOMENTS, QUANTITIES
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.units import sections_of
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.methods.random import random_scenarios

COURT = load_map("court")
FIELD = domain_named("field")


def file_with(folder: Path, text: str, name: str = "mine.toml") -> Path:
    file = folder / name
    file.write_text(text)
    return file


def domain_with(folder: Path, text: str) -> Domain:
    return domain_named(str(file_with(folder, text)))


def drawn(domain: Domain, count: int) -> list[Scenario]:
    return list(random_scenarios(COURT, genome_of(domain, COURT), 3, 0, count))


@pytest.mark.parametrize(("behaviour", "share"), [("chasing", 0.5), ("careless", 0.0)])
def test_half_of_the_events_wait_for_a_decision_where_npcs_may_interfere(
    behaviour: str, share: float
) -> None:
    domain = dataclasses.replace(FIELD, npc_behaviour=behaviour)
    moments = Counter(
        EVENT_MOMENTS[int(QUANTITIES[f"{event}.after"].flown(scenario[f"{event}.after"]))]
        for scenario in drawn(domain, 1500)
        for event in EVENTS
        if any(key.startswith(f"{event}.") for key, _ in scenario.genes)
    )
    assert moments.total() > 300
    assert moments["decided"] / moments.total() == pytest.approx(share, abs=0.08)
    assert {*moments} >= {*MOMENTS}


def test_a_file_extends_a_domain_and_takes_away_groups_and_conditions(tmp_path: Path) -> None:
    domain = domain_with(
        tmp_path,
        'extends = "field"\ntiming = false\n[wind]\nmean_mps = [1, 4]\nturbulence = false\n',
    )
    assert domain.name == "mine"
    assert domain.range_of("wind.mean_mps") == (1.0, 4.0)
    assert domain.range_of("wind.turbulence") is None
    assert "timing" not in domain.groups
    assert domain.range_of("told.error_m") == FIELD.range_of("told.error_m")
    assert domain.npc_behaviour == FIELD.npc_behaviour


def test_a_file_extends_another_file_beside_it(tmp_path: Path) -> None:
    file_with(tmp_path, 'extends = "calm"\n[wind]\nmean_mps = [0, 1]\n', "base.toml")
    domain = domain_with(tmp_path, 'extends = "base.toml"\nnpc_behaviour = "stationary"\n')
    assert domain.range_of("wind.mean_mps") == (0.0, 1.0)
    assert domain.npc_behaviour == "stationary"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[storm]\nmean_mps = [0, 1]", r"key 'storm': unknown key; expected one of .*wind"),
        ("[wind]\nmean_knots = [0, 1]", r"key 'wind.mean_knots': unknown key; .*mean_mps"),
        ("[wind]\nmean_mps = [0, 99]", r"'wind.mean_mps': found \[0, 99\], .* 0 to 15: mean speed"),
        ("[wind]\nmean_mps = [6, 0]", r"'wind.mean_mps': found \[6, 0\], .* lowest value first"),
        ("[wind]\nmean_mps = 6", r"'wind.mean_mps': found 6, expected \[lowest, highest\] or"),
        ("[wind]\nmean_mps = [0, nan]", r"'wind.mean_mps': found .*nan.*, expected \[lowest"),
        ("[weather]\nfog_visibility_m = [1, inf]", r"'weather.fog_visibility_m': .* 10 to inf"),
        ("[light]\nsun_elevation_deg = [0, 30]", r"'light.sun_elevation_deg': .* end at noon, 60"),
        ('extends = "mine.toml"', r"key 'extends': .*circle"),
        ('extends = "fiel"', r"key 'extends': domain: found 'fiel', expected .*field"),
        ('npc_behaviour = "absent"', r"nothing may vary; expected a range such as"),
        ('extends = "paper"\n[wind]\nmean_mps = [0, 1]', r"key 'wind': found ranges in the world"),
        ('paper = "some"', r"key 'paper': found 'some', expected one of"),
    ],
)
def test_a_broken_domain_names_file_and_key(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ScenarioError, match=message) as caught:
        domain_with(tmp_path, text)
    assert str(caught.value).startswith(str(tmp_path / "mine.toml"))


def test_an_unknown_domain_is_refused() -> None:
    with pytest.raises(ScenarioError, match=r"found 'feild', expected .*field.* or a file"):
        domain_named("feild")


@pytest.mark.parametrize("name", ["field", "calm"])
def test_every_group_is_stated_in_field_and_those_of_calm_are_narrower(name: str) -> None:
    domain = domain_named(name)
    for key, low, high in domain.ranges:
        limits = FIELD.range_of(key)
        assert limits is not None
        assert limits[0] <= low <= high <= limits[1]


def test_the_world_of_the_paper_has_the_genes_of_the_paper(tmp_path: Path) -> None:
    assert genome_of(domain_named("paper"), COURT) == genome_for(COURT)
    any_weather = domain_with(tmp_path, 'extends = "paper"\npaper = "full"')
    assert genome_of(any_weather, COURT) == genome_for(COURT, weather="full")


def chromosomes(genome: Genome, count: int) -> list[np.ndarray]:
    rng = np.random.default_rng(5)
    return [genome.random(rng) for _ in range(count)]


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_scenario_survives_its_chromosome(name: str) -> None:
    genome = with_destinations(genome_of(domain_named(name), COURT))
    for row in chromosomes(genome, 100):
        scenario = repair(decode(row, genome, map="court", seed=1), COURT)
        assert decode(encode(scenario, genome), genome, map="court", seed=1) == scenario


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_scenario_survives_its_file_in_physical_units(name: str) -> None:
    genome = with_destinations(genome_of(domain_named(name), COURT))
    for row in chromosomes(genome, 100):
        scenario = repair(decode(row, genome, map="court", seed=1), COURT)
        text = dumps(scenario, COURT)
        assert "[genes" not in text
        assert loads(text, COURT) == scenario


def active_names(scenario: Scenario) -> set[str]:
    objects = {name for name, _ in COURT.all_objects}
    names = {*sections_of(scenario, COURT)} - {"marker"}
    return (
        (names - {"told"})
        | ({"told"} if scenario["told.error_m"] else set())
        | (objects - {*scenario.removed_objects})
    )


def test_few_groups_are_active_and_each_is_sometimes() -> None:
    scenarios = drawn(FIELD, 600)
    found = Counter(name for each in scenarios for name in active_names(each))
    assert max(len(active_names(each)) for each in scenarios) <= 3
    assert min(len(active_names(each)) for each in scenarios) == 0
    assert {*FIELD.groups} - {"npcs", "survey"} <= {*found}
    assert {name for name, _ in COURT.all_objects} <= {*found}


def test_half_of_the_active_draws_lie_in_the_outer_third() -> None:
    scenarios = drawn(FIELD, 1200)
    active = [each["wind.mean_mps"] for each in scenarios if each["wind.mean_mps"]]
    assert len(active) > 80
    assert sum(value > 4.0 for value in active) / len(active) == pytest.approx(0.5, abs=0.1)
    angles = [each["wind.towards_deg"] for each in scenarios if each["wind.mean_mps"]]
    assert sum(angle > 240 for angle in angles) / len(angles) == pytest.approx(1 / 3, abs=0.1)


def test_the_told_coordinate_of_field_is_about_the_marker() -> None:
    for scenario in drawn(FIELD, 200):
        told, marker = Placed(scenario, COURT).told_m, Placed(scenario, COURT).marker_m
        assert np.hypot(told[0] - marker[0], told[1] - marker[1]) <= 5.0 + 1e-3


def test_a_range_without_the_nominal_value_is_always_active(tmp_path: Path) -> None:
    domain = domain_with(tmp_path, "[wind]\nmean_mps = [2, 4]\n[weather]\nrain_mmph = [3, 5]\n")
    for scenario in drawn(domain, 30):
        assert 2.0 <= scenario["wind.mean_mps"] <= 4.0
        assert 0.03 <= scenario["environment.rain"] <= 0.05
        assert len(scenario.removed_objects) == len(COURT.all_objects)


def test_what_lies_outside_a_domain_is_named() -> None:
    calm = domain_named("calm")
    scenario = drawn(calm, 1)[0]
    assert calm.outside(scenario, COURT) == ()
    changed = scenario.replace(
        {"wind.mean_mps": 8.0, "timing.latency_ms": 50.0, "environment.fog": 0.1}
    )
    text = "; ".join(calm.outside(changed, COURT))
    assert "wind.mean_mps = 8, the domain has 0 to 3" in text
    assert "timing.latency_ms = 50, the domain has only 0" in text
    assert "weather.fog_visibility_m = 100, the domain has only inf" in text
    assert "wind.mean_mps" in "".join(domain_named("paper").outside(changed, COURT))


def test_drawn_scenarios_lie_inside_their_domain() -> None:
    for name in BUILT_IN:
        domain = domain_named(name)
        assert [each for each in drawn(domain, 100) if domain.outside(each, COURT)] == []


def test_every_condition_has_a_meaning_and_a_source() -> None:
    assert all(each.meaning and each.source for each in CONDITIONS.values())
    assert {*QUANTITIES} - {"light.turn_deg"} <= {*CONDITIONS}


@pytest.mark.parametrize("name", ["field", "calm"])
def test_every_group_is_stated_in_the_built_in_domains(name: str) -> None:
    """A new group gets ranges there, or ``group = false``, so that nobody forgets it."""
    file = Path(domain_file.__file__).with_name(f"{name}.toml")
    stated = tomllib.loads(file.read_text())
    assert {*GROUPS} <= {*stated}, f"give ranges, or false, in {file.name}"


def test_bred_scenarios_stay_sparse_and_no_gene_is_preferred() -> None:
    genome = genome_of(FIELD, COURT)
    optional = [gene for gene in genome.genes if gene.is_optional]
    # All bits on, as a cross of many parents has them.
    row = dict.fromkeys(genome.keys, 0.75)
    seeds = range(600)
    acting = [active_genes(genome, row, seed) for seed in seeds]
    counts = Counter(name for names in acting for name in names)
    assert {len(names) for names in acting} == {3}
    share = 3 * len(seeds) / len(optional)
    assert all(0.6 * share < counts[gene.name] < 1.4 * share for gene in optional)
    bits = [key.startswith("active.") for key in genome.keys]
    bred = decode(np.where(bits, 0.75, genome.nominal), genome, map="court", seed=1)
    encoded = dict(zip(genome.keys, encode(bred, genome), strict=True))
    assert sum(encoded[gene.properties[0].key] > 0.5 for gene in optional) <= 3
