from __future__ import annotations

import numpy as np
import pytest

from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.chromosome import decode, encode
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.genes import ON_ABOVE, Genome
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.use_file import parse_use, use_of, use_text
from pytest_garl.scenarios.use_model import Matrix, Spread, UseModel
from pytest_garl.scenarios.validity import repair

MAP = load_map("lawn")
FIELD = genome_of(domain_named("field"), MAP)
EXAMPLE = use_text("field", [(FIELD, MAP)])
COUNT = 20_000


def model(text: str = EXAMPLE, genome: Genome = FIELD) -> UseModel:
    return use_of(parse_use(text, "use.toml"), genome, MAP)


def drawn(text: str = EXAMPLE) -> dict[str, Matrix]:
    rows = model(text).rows(COUNT, np.random.default_rng(1))
    return {key: rows[:, column] for column, key in enumerate(FIELD.keys)}


def changed(before: str, after: str) -> str:
    assert before in EXAMPLE
    return EXAMPLE.replace(before, after, 1)


def test_each_condition_and_each_npc_occurs_in_its_share_of_landings() -> None:
    text = changed("[wind]\nshare = 0.1", "[wind]\nshare = 0.6")
    columns = drawn(text)
    for gene in FIELD.genes:
        if gene.is_optional:
            share = float(np.mean(columns[f"active.{gene.name}"] > ON_ABOVE))
            assert share == pytest.approx(0.6 if gene.name == "wind" else 0.1, abs=0.02)


def test_conditions_occur_independently_and_more_than_three_at_once() -> None:
    columns = drawn()
    bits = np.array([values > ON_ABOVE for key, values in columns.items() if key[:7] == "active."])
    assert np.mean(bits.sum(axis=0) > 3) > 0.1
    off_diagonal = np.corrcoef(bits)[~np.eye(len(bits), dtype=bool)]
    assert np.abs(off_diagonal).max() < 0.04


def is_on(key: str, value: float) -> bool:
    return key.startswith("active.") and value > ON_ABOVE


def test_a_scenario_keeps_all_conditions_that_were_drawn() -> None:
    found = model()
    rows = found.rows(200, np.random.default_rng(2))
    bits = [key.startswith("active.") for key in FIELD.keys]
    row = max(rows, key=lambda each: int(np.sum(each[bits] > ON_ABOVE)))
    scenario = repair(decode(row, found.genome, map="lawn", seed=1), MAP)
    acting = [
        g for g in FIELD.genes if g.is_optional and row[FIELD.keys.index(f"active.{g.name}")] > 0.5
    ]
    assert len(acting) > 4
    again = dict(zip(FIELD.keys, encode(scenario, FIELD), strict=True))
    assert all(again[f"active.{gene.name}"] > ON_ABOVE for gene in acting)


def test_values_lie_in_their_range_and_have_their_distribution() -> None:
    text = changed("mean_mps = [0, 6]", "mean_mps = [1, 2, 5]")
    text = text.replace("sun_elevation_deg = [-2.5, 60]", "sun_elevation_deg = [10, 20]")
    text = text.replace("fog_visibility_m = [10, inf]", "fog_visibility_m = [100, 200]")
    columns = drawn(text)
    wind = columns["wind.mean_mps"][columns["active.wind"] > ON_ABOVE]
    assert (wind.min(), wind.max()) == pytest.approx((1, 5), abs=0.1)
    assert wind.mean() == pytest.approx((1 + 2 + 5) / 3, abs=0.06)
    fog = columns["environment.fog"][columns["active.fog"] > ON_ABOVE]
    assert (fog.min(), fog.max()) == pytest.approx((10 / 200, 10 / 100), abs=1e-3)
    sun = columns["environment.sun_position"][columns["active.light"] > ON_ABOVE]
    assert np.mean(sun < 0.5) == pytest.approx(0.5, abs=0.05)
    elevation = -6 + 66 * np.sin(np.pi * sun)
    assert (elevation.min(), elevation.max()) == pytest.approx((10, 20), abs=0.1)


def test_kinds_occur_as_often_as_their_weights_say() -> None:
    text = changed(
        "grade = { careless = 1, curious = 1, chasing = 1 }",
        "grade = { careless = 3, chasing = 1 }",
    )
    columns = drawn(text)
    grades = columns["person-1.grade"][columns["active.person-1"] > ON_ABOVE]
    assert set(np.unique(grades)) == {0, 2}
    assert np.mean(grades == 0) == pytest.approx(0.75, abs=0.04)


def test_nobody_decides_when_an_event_or_an_npc_harms_most() -> None:
    found = model()
    for row in found.rows(300, np.random.default_rng(3)):
        scenario = decode(row, found.genome, map="lawn", seed=1)
        assert not scenario.decided_events
        assert all(value < 7 for key, value in scenario.genes if key.endswith(".phase"))


@pytest.mark.parametrize("peak", [None, 0.0, 3.0, 10.0])
def test_quantiles_reach_both_ends_and_grow(peak: float | None) -> None:
    found = Spread(low=0.0, high=10.0, peak=peak).at(np.linspace(0, 1, 101))
    assert (found[0], found[-1]) == pytest.approx((0, 10))
    assert np.all(np.diff(found) > 0)


def test_the_example_says_that_no_number_is_claimed_to_be_true() -> None:
    assert "None is claimed to be true" in EXAMPLE
    for name in ("calm", "field"):
        genome = genome_of(domain_named(name), MAP)
        text = use_text(name, [(genome, MAP)])
        use_of(parse_use(text, "use.toml"), genome, MAP)


WIND, FOG, BODY = "mean_mps = [0, 6]", "fog_visibility_m = [10, inf]", "{ adult = 1, child = 1 }"
SUN, AFTER = "sun_elevation_deg = [-2.5, 60]", "after = { start = 1,"
SHARE = "[fog]\nshare = 0.1\n"


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("[fog]", "[mist]", "key 'mist': unknown key; expected one of "),
        (SHARE, "[fog]\nshare = 1.1\n", "found 1.1, expected a number from 0 to 1"),
        (SHARE, "[fog]\n", "key 'fog.share': missing"),
        (WIND, "mean_mps = [0, 9]", "expected values within the domain: 0 to 6"),
        (FOG, "fog_visibility_m = [5, 50]", "expected values within the domain: 10 and more"),
        (WIND, "mean_mps = [3, 1]", "found [3, 1], expected numbers in ascending order"),
        (WIND, "mean_mps = 3", "found 3, expected [lowest, highest]"),
        (WIND, "gusts = 3", "key 'wind.gusts': unknown key"),
        ("from_s = [0, 40]", "from_s = [0, nan]", "expected [lowest, highest]"),
        (SUN, "sun_elevation_deg = [0, 30, 60]", "expected [lowest, highest]"),
        (AFTER, "after = { decided = 1,", "key 'jump.after.decided': unknown key"),
        (BODY, "{ adult = 0 }", "expected a weight above 0"),
        (BODY, "[0, 1]", "expected weights such as {adult = 1}, for some of adult, child"),
    ],
)
def test_a_mistake_is_named_with_what_was_expected(before: str, after: str, message: str) -> None:
    with pytest.raises(ScenarioError, match=r"^use\.toml: ") as error:
        model(changed(before, after))
    assert message in str(error.value)


def test_a_condition_that_is_left_out_is_an_error_and_not_rare() -> None:
    text = EXAMPLE.replace("[heading]\nshare = 0.1\nstart_deg = [-180, 180]\n", "")
    with pytest.raises(ScenarioError, match=r"key 'heading': missing; expected a table"):
        model(text)


def test_a_model_for_a_wider_domain_must_say_that_the_rest_never_occurs() -> None:
    calm = genome_of(domain_named("calm"), MAP)
    text = use_text("calm", [(calm, MAP)])
    model(text + "[fog]\nshare = 0\n", calm)
    with pytest.raises(ScenarioError, match="key 'fog': found a condition that the domain keeps"):
        model(text + "[fog]\nshare = 0.1\n", calm)


def test_the_world_of_the_paper_has_no_model_of_use() -> None:
    with pytest.raises(ScenarioError, match="every condition always acts"):
        model(EXAMPLE, genome_of(domain_named("paper"), MAP))
