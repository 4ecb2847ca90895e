from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pytest_garl.scenarios.chromosome import decode, encode
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.columns import Columns
from pytest_garl.search.exploration import Exploration

MAP = load_map("court")
FIELD = Columns(genome_of(domain_named("field"), MAP))


@pytest.mark.parametrize(
    ("domain", "strata"),
    [
        ("field", ("nobody", "careless", "interfering")),
        ("calm", ("nobody", "careless")),
    ],
)
def test_a_domain_has_the_strata_that_its_npcs_allow(domain: str, strata: tuple[str, ...]) -> None:
    assert Columns(genome_of(domain_named(domain), MAP)).strata == strata


@pytest.mark.parametrize(
    ("ranges", "has_place"),
    [("x_m = [-1, 1]\ny_m = [-2, 2]", True), ("y_m = false", False), ("x_m = false", False)],
)
def test_a_decoy_has_a_place_unless_the_domain_takes_it_away(
    ranges: str, has_place: bool, tmp_path: Path
) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(f'extends = "field"\n[decoy-1]\n{ranges}\n')
    columns = Columns(genome_of(domain_named(str(file)), MAP))
    (decoy,) = (gene for gene in columns.optional if gene.name == "decoy-1")
    assert (decoy.place_column >= 0) == has_place
    exploration, rng = Exploration(columns, MAP), np.random.default_rng(0)
    for _ in range(40):
        row = exploration.new("nobody", rng)
        assert ((row >= columns.lower) & (row <= columns.upper)).all()


def test_the_world_of_the_paper_has_no_strata() -> None:
    assert Columns(genome_for(MAP)).strata == ()


def test_slices_hold_all_columns_of_their_gene_and_its_bit() -> None:
    keys = FIELD.genome.keys
    found = {keys[each.start]: keys[each] for each in FIELD.slices}
    wind = ("active.wind", "wind.mean_mps", "wind.towards_deg", "wind.turbulence")
    assert found["active.wind"] == wind
    assert found["marker.x"] == ("marker.x", "marker.y")
    assert {keys[bit] for bit in FIELD.bits} == {key for key in found if key.startswith("active.")}


def test_choices_and_other_whole_numbers_are_told_from_numbers() -> None:
    keys = FIELD.genome.keys
    kind = keys.index("decoy-1.kind")
    assert FIELD.chosen[kind]
    assert FIELD.chosen[kind]
    assert not FIELD.chosen[keys.index("wind.mean_mps")]


def test_the_stratum_is_that_of_the_strongest_grade() -> None:
    keys = FIELD.genome.keys
    row = FIELD.with_active(FIELD.genome.nominal, ("fog",))
    assert FIELD.stratum(row) == "nobody"
    row = FIELD.with_active(row, ("dog-1", "person-1"))
    assert FIELD.stratum(row) == "careless"
    row[keys.index("dog-1.grade")] = 2.5
    assert FIELD.stratum(row) == "interfering"


def test_a_choice_has_the_number_that_is_flown() -> None:
    genome, rng = FIELD.genome, np.random.default_rng(4)
    rows = np.array(
        [genome.random_active(rng, ("person-1", "cover", "decoy-1")) for _ in range(40)]
    )
    scenarios = [
        repair(decode(row, genome, map="court", seed=number), MAP)
        for number, row in enumerate(rows)
    ]
    flown = FIELD.numbers(np.array([encode(scenario, genome) for scenario in scenarios]))
    chosen = [
        genome.keys.index(key)
        for key in ("person-1.grade", "person-1.phase", "cover.after", "decoy-1.kind")
    ]
    assert np.array_equal(FIELD.numbers(rows)[:, chosen], flown[:, chosen])
    assert len({*flown[:, chosen[1]]}) > 4
