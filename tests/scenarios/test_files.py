"""A scenario survives its file; a broken file names the key."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.files import dump_scenario, dumps, load, loads, parse_scenario
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.genome_like import with_destinations
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.units import sections_of
from pytest_garl.scenarios.validity import problems, repair

COURT = load_map("court")


def test_conditions_survive_the_file_which_names_only_those_that_are_not_nominal() -> None:
    genome = genome_for(COURT)
    plain = repair(decode(genome.nominal, genome, map="court", seed=3), COURT)
    scenario = plain.replace({"wind.mean_mps": 4.5})
    assert "[scenario.wind]\nmean_mps = 4.5\n" in dumps(scenario, COURT)
    assert loads(dumps(scenario, COURT), COURT) == scenario
    assert dumps(plain.replace({"wind.mean_mps": 0.0}), COURT) == dumps(plain, COURT)


def test_elevation_or_azimuth_of_the_sun_alone_is_enough() -> None:
    genome = genome_for(COURT)
    plain = repair(decode(genome.nominal, genome, map="court", seed=3), COURT)

    def light(*lines: str) -> dict[str, float]:
        text = "\n".join([dumps(plain, COURT), "[scenario.light]", *lines, ""])
        return sections_of(loads(text, COURT), COURT)["light"]

    # On the sun's way of the day, in the morning.
    low = light("sun_elevation_deg = 12.0")
    assert low["sun_elevation_deg"] == 12.0
    assert 90 < low["sun_azimuth_deg"] < 180
    assert light(*(f"{name} = {value}" for name, value in low.items())) == low
    # As high as at noon.
    assert light("sun_azimuth_deg = 90.0") == {
        "sun_elevation_deg": 60.0,
        "sun_azimuth_deg": 90.0,
    }


def test_a_condition_that_cannot_be_flown_is_refused() -> None:
    genome = genome_for(COURT)
    plain = repair(decode(genome.nominal, genome, map="court", seed=3), COURT)
    text = dumps(plain.replace({"wind.mean_mps": 4.5}), COURT)
    with pytest.raises(ScenarioError, match=r"scenario.wind.mean_mps'?: found 99.*15"):
        loads(text.replace("4.5", "99"), COURT)
    with pytest.raises(ScenarioError, match=r"scenario.wind.mean_knots'?: unknown key"):
        loads(text.replace("mean_mps", "mean_knots"), COURT)


def test_destinations_survive_the_file_and_are_asked_of_every_object() -> None:
    genome = with_destinations(genome_for(COURT))
    row = genome.random(np.random.default_rng(3))
    scenario = repair(decode(row, genome, map="court", seed=3), COURT)
    text = dumps(scenario, COURT)
    assert text.count("[scenario.dog-1]") == 1
    assert loads(text, COURT) == scenario
    alone = scenario.without("dog-1", "bird-1")
    assert loads(dumps(alone, COURT), COURT) == alone
    head, _, tail = text.partition("[scenario.dog-1]")
    x_m = re.search(r"destination_x_m = .*\n", tail)
    assert x_m is not None
    with pytest.raises(ScenarioError, match=r"scenario.dog-1.destination_x_m'?: missing"):
        loads(f"{head}[scenario.dog-1]{tail.replace(x_m.group(), '', 1)}", COURT)


IN_UNITS = dumps(
    repair(
        decode(genome_for(COURT).nominal, genome_for(COURT), map="court", seed=1), COURT
    ).replace({"environment.fog": 0.1}),
    COURT,
)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("fog_visibility_m = 100.0", "fog_visibility_m = 3.0", "'scenario.weather.fog_visibility"),
        ("fog_visibility_m = 100.0", "mist_m = 3.0", "'scenario.weather.mist_m': unknown key"),
        ("[scenario.marker]", "[scenario.market]", "'scenario.market': unknown key"),
        ("schema = 2", "schema = 9", "'schema': found 9, expected 2"),
        ("x_m = 0.0", "", "'scenario.marker.x_m': missing"),
        # The first of two, whatever the seed of hashes is.
        ("x_m = 0.0\ny_m = 0.0", "", "'scenario.marker.x_m': missing"),
        ("x_m = 0.0", "x_m = 99.0", "'scenario.marker.x_m': found 99"),
    ],
)
def test_a_broken_file_in_units_names_file_and_key(old: str, new: str, expected: str) -> None:
    assert old in IN_UNITS
    with pytest.raises(ScenarioError) as caught:
        loads(IN_UNITS.replace(old, new, 1), COURT, source="case.toml")
    assert "case.toml" in str(caught.value)
    assert expected in str(caught.value)


# The values of this one have more digits than a file in units, so its file lists genes.
GOOD = dumps(decode(genome_for(COURT).nominal, genome_for(COURT), map="court", seed=1), COURT)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("seed = 1", "seed = ", "not valid TOML"),
        ("fog = 0.0", "fog = 1.5", "'genes.environment.fog': found 1.5"),
        ("fog = 0.0", "fog = nan", "'genes.environment.fog'"),
        ("fog = 0.0", 'fog = "thick"', "expected a number"),
        ("fog = 0.0", "mist = 0.0", "'genes.environment.mist': unknown key"),
        ("schema = 2", "schema = 9", "'schema': found 9, expected 2"),
        ('map = "court"', 'map = "lawn"', "expected 'court'"),
        ("seed = 1", "seed = -1", "'seed'"),
    ],
)
def test_a_broken_scenario_file_names_file_and_key(old: str, new: str, expected: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        loads(GOOD.replace(old, new), COURT, source="case.toml")
    assert "case.toml" in str(caught.value)
    assert expected in str(caught.value)


def test_a_missing_gene_is_named() -> None:
    with pytest.raises(ScenarioError, match="no gene 'fog'"):
        Scenario(map="court", seed=0, genes=())["fog"]


def test_absent_objects_survive_the_file_and_have_no_genes() -> None:
    genome = genome_for(COURT)
    whole = repair(decode(genome.nominal, genome, map="court", seed=4), COURT)
    name = COURT.present_objects[0][0]
    fewer = whole.without(name)
    assert not any(key.startswith(f"{name}.") for key, _ in fewer.genes)
    assert loads(dumps(fewer, COURT), COURT) == fewer
    assert problems(fewer, COURT) == ()
    assert repair(fewer, COURT) == fewer


def test_an_absent_object_must_be_one_of_the_map() -> None:
    genome = genome_for(COURT)
    text = dumps(decode(genome.nominal, genome, map="court", seed=4), COURT)
    text = text.replace("seed = 4", 'seed = 4\nabsent = ["cat-1"]')
    with pytest.raises(ScenarioError, match=r"'absent': map 'court' has no object cat-1"):
        loads(text, COURT)


SCENARIO = dumps(decode(genome_for(COURT).nominal, genome_for(COURT), map="court", seed=1), COURT)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("fog = 0.0", "fog = " + "9" * 400, "'genes.environment.fog': found 999"),
        ("fog = 0.0", f"fog = 0x{'f' * 5000}", "'genes.environment.fog': found int too long"),
        ("fog = 0.0", f'fog = "{"x" * 5000}"', "'genes.environment.fog': found 'xxx"),
        ("seed = 1", f"seed = {2**63}", "'seed': found 9223372036854775808, expected a whole"),
        ("fog = 0.0", f'"{"k" * 5000}" = 0.0', "unknown key"),
        ("fog = 0.0", '"\\u001b[2J" = 0.0', r"'genes.environment.\\x1b\[2J': unknown key"),
    ],
)
def test_a_strange_scenario_is_one_short_error(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    assert old in SCENARIO
    file = tmp_path / "one.toml"
    file.write_text(SCENARIO.replace(old, new))
    with pytest.raises(ScenarioError, match=words) as caught:
        load(file)
    assert str(file) in str(caught.value)
    assert len(str(caught.value)) < 700


@pytest.mark.parametrize("removed", [(), ("dog-1",)])
def test_scenario_survives_its_line_of_json(removed: tuple[str, ...]) -> None:
    genome = genome_for(load_map("lawn"))
    scenario = decode(genome.nominal, genome, map="lawn", seed=1)
    for name in removed:
        scenario = scenario.without(name)
    assert parse_scenario(dump_scenario(scenario)) == scenario


def test_damaged_line_of_json_is_one_error() -> None:
    with pytest.raises(ScenarioError, match="a stored scenario is damaged: map: found 1"):
        parse_scenario('{"map": 1, "seed": 1, "genes": []}')
    with pytest.raises(ScenarioError, match="a stored scenario is damaged: not valid JSON"):
        parse_scenario("{")
