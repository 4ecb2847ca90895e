from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.chromosome import decode, encode
from pytest_garl.scenarios.files import dumps, loads
from pytest_garl.scenarios.genes import EXTRAS, genome_for, genome_like, with_destinations
from pytest_garl.scenarios.maps.map import load_map, map_names
from pytest_garl.scenarios.placement import disc_to_square, square_to_disc
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.strategies import scenarios
from pytest_garl.scenarios.validity import problems, repair

COURT = load_map("court")
unit = st.floats(0, 1)


@given(shares=st.lists(unit, min_size=23, max_size=23), seed=st.integers(0, 2**63))
def test_decode_and_encode_are_exact_inverses(shares: list[float], seed: int) -> None:
    genome = genome_for(COURT)
    vector = genome.lower + np.array(shares) * (genome.upper - genome.lower)
    vector = np.clip(vector, genome.lower, genome.upper)
    scenario = decode(vector, genome, map="court", seed=seed)
    assert (encode(scenario, genome) == vector).all()
    assert decode(encode(scenario, genome), genome, map="court", seed=seed) == scenario


@pytest.mark.parametrize("map", ["court", "lawn"])
@given(data=st.data())
@settings(max_examples=60, deadline=None)
def test_every_drawn_scenario_is_valid_and_survives_its_file(map: str, data: st.DataObject) -> None:
    scenario = data.draw(scenarios(map))
    place = load_map(map)
    assert problems(scenario, place) == ()
    assert repair(scenario, place) == scenario
    assert loads(dumps(scenario), place) == scenario


def test_repair_changes_only_the_offending_genes() -> None:
    genome = genome_for(COURT)
    nominal = decode(genome.nominal, genome, map="court", seed=1)
    on_marker = nominal.replace({"dog-1.start_x": 0.0, "dog-1.start_y": 0.0})
    mended = repair(on_marker, COURT)
    changed = {key for key, value in on_marker.genes if mended[key] != value}
    assert changed <= {"dog-1.start_x", "dog-1.start_y"} | {
        key for key, _ in nominal.genes if repair(nominal, COURT)[key] != nominal[key]
    }
    assert {"dog-1.start_x", "dog-1.start_y"} & changed


def test_uniform_genes_give_a_uniform_disc() -> None:
    rng = np.random.default_rng(0)
    radii = [np.hypot(*square_to_disc(*rng.uniform(-1, 1, 2))) for _ in range(4000)]
    # For a uniform disc the squared radius is uniform on [0, 1]: mean 1/2, variance 1/12.
    assert np.mean(np.square(radii)) == pytest.approx(0.5, abs=0.02)
    assert np.var(np.square(radii)) == pytest.approx(1 / 12, abs=0.01)


@given(x=st.floats(-1, 1), y=st.floats(-1, 1))
def test_disc_to_square_inverts_square_to_disc(x: float, y: float) -> None:
    back = disc_to_square(*square_to_disc(x, y))
    assert square_to_disc(*back) == pytest.approx(square_to_disc(x, y), abs=1e-9)


def test_weather_is_confined_unless_the_full_range_is_asked_for() -> None:
    confined, full = genome_for(COURT), genome_for(COURT, weather="full")
    assert confined.upper[confined.keys.index("environment.fog")] == 0.15
    assert full.upper[full.keys.index("environment.fog")] == 1.0
    assert confined.upper[confined.keys.index("environment.sun_position")] == 1.0


def test_borders_fall_between_nuclear_genes() -> None:
    genome = genome_for(COURT, extras=[EXTRAS["wind"]])
    starts = {genome.keys.index(gene.properties[0].key) for gene in genome.genes}
    assert set(genome.borders) == starts - {0}


def test_extra_genes_survive_the_file() -> None:
    genome = genome_for(COURT, extras=EXTRAS.values())
    scenario = decode(genome.nominal, genome, map="court", seed=3).replace({"wind.x": 0.5})
    assert loads(dumps(scenario), COURT) == scenario


def test_destinations_survive_the_file_and_are_asked_of_every_object() -> None:
    genome = with_destinations(genome_for(COURT))
    row = genome.random(np.random.default_rng(3))
    scenario = repair(decode(row, genome, map="court", seed=3), COURT)
    text = dumps(scenario)
    assert text.count("[genes.dog-1]") == 1
    assert loads(text, COURT) == scenario
    alone = scenario.without("dog-1", "bird-1")
    assert loads(dumps(alone), COURT) == alone
    x = scenario["dog-1.destination_x"]
    with pytest.raises(ScenarioError, match=r"genes.dog-1.destination_x'?: missing"):
        loads(text.replace(f"destination_x = {x!r}\n", ""), COURT)


def test_the_genome_of_scenarios_is_known_by_their_keys() -> None:
    plain = genome_for(COURT, weather="full")
    assert genome_like(plain.keys, COURT) == plain
    whole = with_destinations(genome_for(COURT, weather="full", extras=EXTRAS.values()))
    assert genome_like(whole.keys, COURT) == whole


GOOD = dumps(decode(genome_for(COURT).nominal, genome_for(COURT), map="court", seed=1))


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("seed = 1", "seed = ", "not valid TOML"),
        ("fog = 0.0", "fog = 1.5", "'genes.environment.fog': found 1.5"),
        ("fog = 0.0", "fog = nan", "'genes.environment.fog'"),
        ("fog = 0.0", 'fog = "thick"', "expected a number"),
        ("fog = 0.0", "mist = 0.0", "'genes.environment.mist': unknown key"),
        ("schema = 1", "schema = 9", "'schema': found 9, expected 1"),
        ('map = "court"', 'map = "lawn"', "expected 'court'"),
        ("seed = 1", "seed = -1", "'seed'"),
    ],
)
def test_a_broken_scenario_file_names_file_and_key(old: str, new: str, expected: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        loads(GOOD.replace(old, new), COURT, source="case.toml")
    assert "case.toml" in str(caught.value)
    assert expected in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("title", "title = ", "not valid TOML"),
        ('texture = "grass"', 'texture = "lava"', "'ground.texture': found 'lava'"),
        ('kind = "tree"', 'kind = "ufo"', "'bodies[0].kind': found 'ufo'"),
        ("person = 2", "whale = 2", "'objects.whale': unknown key"),
        ("seed = 2029", "", "'ground.seed': missing"),
        ("height_m = 5.5", "height_m = -1", "'bodies[0].height_m': found -1"),
        ("bounds_m = [-10.0", "bounds_m = [-5.0", "'bounds_m': the disc of 7.5 m"),
    ],
)
def test_a_broken_map_names_file_and_key(tmp_path: Path, old: str, new: str, expected: str) -> None:
    import pytest_garl.scenarios.maps.map as maps

    text = (Path(maps.__file__).parent / "lawn.toml").read_text()
    (tmp_path / "mine.toml").write_text(text.replace(old, new, 1))
    with pytest.raises(ScenarioError) as caught:
        load_map("mine", [tmp_path])
    assert "mine.toml" in str(caught.value)
    assert expected in str(caught.value)


def test_a_users_map_is_found_by_name(tmp_path: Path) -> None:
    import pytest_garl.scenarios.maps.map as maps

    text = (Path(maps.__file__).parent / "lawn.toml").read_text()
    (tmp_path / "garden.toml").write_text(text)
    assert load_map("garden", [tmp_path]).name == "garden"
    assert map_names([tmp_path]) == ("court", "garden", "lawn")


def test_an_unknown_map_lists_the_known() -> None:
    with pytest.raises(ScenarioError, match="unknown map 'moon'; expected one of court, lawn"):
        load_map("moon")


def test_a_chromosome_out_of_range_names_the_gene() -> None:
    genome = genome_for(COURT)
    vector = genome.nominal
    vector[genome.keys.index("environment.fog")] = 0.2
    with pytest.raises(ScenarioError, match=r"environment\.fog.*found 0.2"):
        decode(vector, genome, map="court", seed=0)


def test_asking_for_a_gene_that_is_not_there_names_it() -> None:
    with pytest.raises(ScenarioError, match="no gene 'fog'"):
        Scenario(map="court", seed=0, genes=())["fog"]


def test_absent_objects_survive_the_file_and_have_no_genes() -> None:
    genome = genome_for(COURT)
    whole = repair(decode(genome.nominal, genome, map="court", seed=4), COURT)
    name = COURT.object_names[0][0]
    fewer = whole.without(name)
    assert not any(key.startswith(f"{name}.") for key, _ in fewer.genes)
    assert loads(dumps(fewer), COURT) == fewer
    assert problems(fewer, COURT) == ()
    assert repair(fewer, COURT) == fewer


def test_an_absent_object_must_be_one_of_the_map() -> None:
    genome = genome_for(COURT)
    text = dumps(repair(decode(genome.nominal, genome, map="court", seed=4), COURT))
    text = text.replace("seed = 4", 'seed = 4\nabsent = ["cat-1"]')
    with pytest.raises(ScenarioError, match=r"'absent': map 'court' has no object cat-1"):
        loads(text, COURT)
