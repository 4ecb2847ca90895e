"""Rules over conditions: what is learned, and that held-out flights judge it."""

from __future__ import annotations

import dataclasses
import hashlib

import numpy as np
import pytest

from pytest_garl.reports.failure_regions import (
    chance_of,
    failure_region,
    taught_and_held_out,
)
from pytest_garl.reports.failure_rules import (
    ConditionTable,
    Mask,
    learn_rule,
    table_of_scenarios,
)
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario

MAP = load_map("lawn")
GENOME = genome_of(domain_named("field"), MAP)
COUNT = 600


def scenarios() -> list[Scenario]:
    rng = np.random.default_rng(7)
    return [decode(GENOME.random(rng), GENOME, map="lawn", seed=number) for number in range(COUNT)]


SCENARIOS = scenarios()
TABLE = table_of_scenarios(SCENARIOS, MAP)
HALF: Mask = np.arange(COUNT) % 2 == 0


def region(shows: Mask) -> tuple[str, float, float]:
    found = failure_region("kind", TABLE, shows, HALF, ~HALF)
    return found.rule, found.precision, found.recall


def test_a_rule_names_the_quantity_its_side_and_its_unit() -> None:
    wind = np.array([each["wind.mean_mps"] for each in SCENARIOS])
    rule, precision, recall = region(wind > 4)
    assert rule.startswith("wind mean above 3.")
    assert rule.endswith("m/s")
    assert min(precision, recall) > 0.8


def test_a_visibility_and_a_low_sun_are_told_in_units_of_files() -> None:
    fog = np.array([each["environment.fog"] for each in SCENARIOS])
    rule, _, _ = region(fog > 0.5)
    assert rule.startswith("fog visibility below ")
    assert 17 < float(rule.split()[-2]) < 27
    sun = TABLE.values["environment.sun_position"]
    rule, _, _ = region(sun < 30)
    assert rule.startswith("sun elevation below ")
    assert 20 < float(rule.split()[-2]) < 40


def test_npcs_are_told_by_their_type_and_by_what_they_know() -> None:
    dog = np.array(["dog-1" not in each.removed_objects for each in SCENARIOS])
    assert region(dog) == ("a dog", 1.0, 1.0)
    knows = dog & np.array([each.get("dog-1.grade", 0.0) >= 1 for each in SCENARIOS])
    assert region(knows) == ("a dog that is curious or stronger", 1.0, 1.0)


def test_two_conditions_are_found_that_matter_together_only() -> None:
    rng = np.random.default_rng(2)
    first, second, third = rng.uniform(0, 1, (3, 2000))
    values = {
        "wind.mean_mps": 6 * first,
        "timing.latency_ms": 200 * second,
        "pad.worn_percent": third,
    }
    features = {key: TABLE.features[key] for key in values}
    table = ConditionTable(features=features, values=values)
    rule = learn_rule(table, (first > 0.6) & (second > 0.6))
    assert rule is not None
    assert {each.key for each in rule.conditions} == {"wind.mean_mps", "timing.latency_ms"}
    assert len(rule.conditions) == 2


def test_failures_by_chance_give_no_rule() -> None:
    found = [region(np.random.default_rng(seed).random(COUNT) < 0.1)[0] != "" for seed in range(20)]
    assert sum(found) <= 3


def test_a_rule_says_the_same_each_time_and_nothing_with_few_failures() -> None:
    wind = np.array([each["wind.mean_mps"] for each in SCENARIOS])
    assert region(wind > 4) == region(wind > 4)
    few = np.zeros(COUNT, dtype=bool)
    few[:14:2] = True
    assert learn_rule(TABLE, few) is None
    assert learn_rule(TABLE, np.ones(COUNT, dtype=bool)) is None


def test_a_bred_flight_judges_no_rule_and_teaches_only_with_all_its_parents() -> None:
    plain: dict[str, tuple[str, ...]] = {f"lawn-g00-s{number:02d}": () for number in range(40)}
    taught, held_out = taught_and_held_out(plain)
    assert taught | held_out == {*plain}
    assert min(len(taught), len(held_out)) > 10
    good, bad = sorted(taught)[0], sorted(held_out)[0]
    bred = {
        "lawn-g01-s00": (good,),
        "lawn-g01-s01": (good, bad),
        "lawn-g02-s00": ("lawn-g01-s00", "archived-3"),
        "lawn-g02-s01": ("lawn-g01-s01", good),
    }
    more_taught, more_held_out = taught_and_held_out(plain | bred)
    assert more_held_out == held_out
    assert more_taught - taught == {"lawn-g01-s00", "lawn-g02-s00"}


def test_halves_do_not_alternate_as_strata_do() -> None:
    slots = [f"lawn-g05-s{number:02d}" for number in range(20)]
    halves = [hashlib.sha256(each.encode()).digest()[0] % 2 for each in slots]
    assert 0 < sum(halves[::2]) < 10


@pytest.mark.parametrize(
    ("counts", "chance"),
    [((10, 5, 5, 5), 1 / 252), ((10, 5, 5, 0), 1.0), ((10, 5, 0, 0), 1.0), ((4, 2, 1, 1), 0.5)],
)
def test_chance_is_that_of_a_draw_without_replacement(
    counts: tuple[int, int, int, int], chance: float
) -> None:
    assert chance_of(*counts) == pytest.approx(chance)


def test_a_rule_as_good_as_chance_is_none() -> None:
    shows = np.zeros(COUNT, dtype=bool)
    wind = np.array([each["wind.mean_mps"] for each in SCENARIOS])
    shows[HALF] = wind[HALF] > 4
    assert learn_rule(TABLE.of(HALF), shows[HALF]) is not None
    shows[np.flatnonzero(~HALF & (wind == 0))[:20]] = True
    found = failure_region("kind", TABLE, shows, HALF, ~HALF)
    assert found == dataclasses.replace(found, rule="", covered=0, hits=0, failing=20)
