from __future__ import annotations

import itertools
from collections import Counter

import numpy as np
import pytest

from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.search.columns import STRATA, Columns
from pytest_garl.search.exploration import Exploration

MAP = load_map("court")
COLUMNS = Columns(genome_of(domain_named("field"), MAP))
GENES = {gene.name: gene for gene in COLUMNS.optional}
EVENTS = {"jump", "outage", "burst", "cover"}


def exploration(flight_s: float = float("inf")) -> Exploration:
    found = Exploration(COLUMNS, MAP)
    found.flight_s = flight_s
    return found


@pytest.mark.parametrize("stratum", STRATA)
def test_a_scenario_belongs_to_its_stratum_and_is_sparse(stratum: str) -> None:
    ours, rng = exploration(20.0), np.random.default_rng(0)
    for _ in range(50):
        row = ours.new(stratum, rng)
        assert COLUMNS.stratum(row) == stratum
        assert len(COLUMNS.active(row)) == 3
        assert ((row >= COLUMNS.lower) & (row <= COLUMNS.upper)).all()


def test_conditions_are_harsher_than_the_domain_draws_them() -> None:
    ours, rng = exploration(), np.random.default_rng(0)
    row = COLUMNS.genome.random(rng)
    for gene in COLUMNS.optional:
        if gene.is_npc or not COLUMNS.outward[gene.values].any():
            continue
        drawn = [COLUMNS.genome.random_active(rng, (gene.name,))[gene.values] for _ in range(200)]
        plain = [COLUMNS.harshness(values, gene) for values in drawn]
        harsh = [COLUMNS.harshness(ours.values(gene, row, rng), gene) for _ in range(200)]
        assert np.mean(harsh) > np.mean(plain), gene.name


@pytest.mark.parametrize("name", ["jump", "outage", "burst", "cover"])
@pytest.mark.parametrize(("flight_s", "latest_s"), [(20.0, 20.0), (90.0, 40.0)])
def test_events_begin_while_flights_last(name: str, flight_s: float, latest_s: float) -> None:
    ours, rng, gene = exploration(flight_s), np.random.default_rng(0), GENES[name]
    row = COLUMNS.genome.random(rng)
    begins = [
        ours.values(gene, row, rng)[gene.begins_column - gene.values.start] for _ in range(200)
    ]
    assert 0.9 * latest_s < max(begins) <= latest_s


def test_half_of_the_pairs_of_events_coincide() -> None:
    ours, rng = exploration(), np.random.default_rng(0)
    outage, cover = GENES["outage"], GENES["cover"]
    together = pairs = 0
    for _ in range(1500):
        row = ours.new("nobody", rng)
        if {"outage", "cover"} <= {gene.name for gene in COLUMNS.active(row)}:
            pairs += 1
            spans = [
                (row[each.begins_column], row[each.begins_column] + row[each.lasts_column])
                for each in (outage, cover)
            ]
            moments = {round(row[each.after_column]) for each in (outage, cover)}
            overlap = max(start for start, _ in spans) < min(end for _, end in spans)
            together += len(moments) == 1 and overlap
    assert pairs > 10
    assert 0.4 < together / pairs < 0.8


def test_decoys_lie_nearer_to_the_way_than_the_domain_puts_them() -> None:
    rng, gene = np.random.default_rng(0), GENES["decoy-1"]
    start, middle = np.array(MAP.uav_start_m[:2]), np.array(MAP.gps_position_m)

    def off_way_m(draws: int) -> float:
        ours = exploration()
        ours.draws, distances = draws, []
        for _ in range(100):
            row = COLUMNS.with_active(COLUMNS.genome.random(rng), ("decoy-1",))
            row[gene.values] = ours.values(gene, row, rng)
            scenario = decode(row, COLUMNS.genome, map=MAP.name, seed=0)
            told = np.array(Placed(scenario, MAP).told_m)
            place = middle + row[gene.place_column : gene.place_column + 2]
            line = [start + share * (told - start) for share in np.linspace(0, 1, 200)]
            distances.append(min(float(np.linalg.norm(place - each)) for each in line))
        return float(np.mean(distances))

    assert off_way_m(Exploration.draws) < 0.7 * off_way_m(1)


def drawn_genes(count: int) -> list[set[str]]:
    """Return which conditions act in scenarios without NPCs."""
    ours, rng = exploration(), np.random.default_rng(0)
    rows = [ours.new("nobody", rng) for _ in range(count)]
    return [{gene.name for gene in COLUMNS.active(row)} for row in rows]


def test_all_conditions_act_about_equally_often_and_events_more() -> None:
    acted = Counter(itertools.chain.from_iterable(drawn_genes(60)))
    conditions = {gene.name for gene in COLUMNS.optional if not gene.is_npc}
    assert {*acted} == conditions
    other = [acted[name] for name in conditions - EVENTS]
    assert max(other) - min(other) <= 3
    events = [acted[name] for name in EVENTS]
    assert max(events) - min(events) <= 3
    assert min(events) > max(other)


def test_a_third_of_the_scenarios_have_two_events_all_pairs_equally_often() -> None:
    pairs = [frozenset(names & EVENTS) for names in drawn_genes(600)]
    counts = Counter(pair for pair in pairs if len(pair) == 2)
    assert {*counts} == {frozenset(pair) for pair in itertools.combinations(EVENTS, 2)}
    assert 0.3 < counts.total() / len(pairs) < 0.45
    assert max(counts.values()) - min(counts.values()) < 0.1 * counts.total()
