from __future__ import annotations

import numpy as np
import pytest

from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.search import evolution as module
from pytest_garl.search.columns import Columns
from pytest_garl.search.evolution import NOBODY, Brood, Choice, Chosen, Evolution
from pytest_garl.search.exploration import Exploration
from pytest_garl.search.model import PROPERTIES, MarginModel
from pytest_garl.search.operators import Matrix

MAP = load_map("court")
SPARSE = Columns(genome_of(domain_named("field"), MAP))
DENSE = Columns(genome_of(domain_named("field"), MAP, is_dense=True))
PAPER = Columns(genome_for(MAP))
ALL = (SPARSE, DENSE, PAPER)


def flights(columns: Columns, count: int, seed: int = 0) -> Matrix:
    rng = np.random.default_rng(seed)
    return np.array([columns.genome.random(rng) for _ in range(count)])


def bred(
    columns: Columns, rows: Matrix, proximity: Matrix | None = None
) -> tuple[Brood, MarginModel]:
    if proximity is None:
        proximity = np.zeros((len(rows), len(PROPERTIES)))
    fails = (proximity >= 1).any(axis=1).astype(float)
    model = MarginModel(columns, rows, proximity, fails, fails)
    exploration, rng = Exploration(columns, MAP), np.random.default_rng(5)
    return Evolution(columns, exploration, model, rows, rng).candidates(), model


def chosen(brood: Brood, model: MarginModel, violated: Matrix, count: int) -> list[Chosen]:
    choice, anything = Choice(brood, model, violated), np.ones(len(brood), dtype=bool)
    found = [choice.best(anything) for _ in range(count)]
    return [each for each in found if each is not None]


@pytest.mark.parametrize("columns", ALL, ids=["sparse", "dense", "paper"])
def test_a_child_has_whole_genes_of_two_flights_or_more(columns: Columns) -> None:
    rows = flights(columns, 12)
    brood, _ = bred(columns, rows)
    assert len(brood) > 200
    for row, sources in zip(brood.rows, brood.sources, strict=True):
        assert len({*sources} - {NOBODY}) >= 2
        for gene in np.flatnonzero(sources != NOBODY):
            own = columns.slices[gene]
            assert np.array_equal(row[own], rows[sources[gene], own])
    assert ((brood.rows >= columns.lower) & (brood.rows <= columns.upper)).all()


def test_a_child_of_sparse_flights_is_sparse_and_may_have_a_gene_that_nobody_flew() -> None:
    brood, _ = bred(SPARSE, flights(SPARSE, 12))
    acting = [len(SPARSE.active(row)) for row in brood.rows]
    whole = [int((sources != NOBODY).sum()) for sources in brood.sources]
    assert {*acting} == {2, 3} or {*acting} == {3}
    assert min(whole) == 2
    assert any(a > b for a, b in zip(acting, whole, strict=True))


def test_the_rest_of_a_child_is_from_the_flight_that_its_npc_is_from() -> None:
    rows = flights(SPARSE, 30)
    brood, _ = bred(SPARSE, rows)
    npcs = {gene.bit for gene in SPARSE.optional if gene.is_npc}
    place = next(own for own in SPARSE.slices if own.start not in SPARSE.bits)
    found = 0
    for row, sources, base in zip(brood.rows, brood.sources, brood.bases, strict=True):
        assert np.array_equal(row[place], rows[base, place])
        own = [s for own, s in zip(SPARSE.slices, sources, strict=True) if own.start in npcs]
        given = [each for each in own if each != NOBODY]
        if len(given) == 1:
            found += 1
            assert base in {*sources}
    assert found > 5


def test_flights_without_two_conditions_have_no_children() -> None:
    rows = np.array([SPARSE.with_active(row, ()) for row in flights(SPARSE, 6)])
    rows[0] = SPARSE.with_active(rows[0], ("fog",))
    brood, model = bred(SPARSE, rows)
    assert len(brood) == 0
    assert chosen(brood, model, np.zeros((6, len(PROPERTIES))), 3) == []


def test_the_same_flights_breed_the_same_children() -> None:
    rows = flights(SPARSE, 12)
    first, again = (bred(SPARSE, rows)[0] for _ in range(2))
    assert first.rows.tobytes() == again.rows.tobytes()


def with_wind_and_fog() -> tuple[Matrix, Matrix]:
    """Return flights in which strong wind violates a property, and fog another one."""
    rows, rng = flights(SPARSE, 40), np.random.default_rng(1)
    keys = SPARSE.genome.keys
    proximity = np.zeros((40, len(PROPERTIES)))
    for index, names in enumerate(
        [("wind", "heading"), ("fog", "pad"), ("told",), ("depth",)] * 10
    ):
        rows[index] = SPARSE.with_active(rows[index], names)
        strength = rng.uniform(0.5, 1.0)
        rows[index, keys.index("wind.mean_mps")] = 6 * strength
        rows[index, keys.index("environment.fog")] = strength
        if names[0] in ("wind", "fog"):
            proximity[index, names[0] == "fog"] = 1.2 * (strength > 0.7)
    return rows, proximity


def acting(brood: Brood | Matrix) -> list[set[str]]:
    rows = brood.rows if isinstance(brood, Brood) else brood
    return [{gene.name for gene in SPARSE.active(row)} for row in rows]


def test_the_first_child_has_what_the_model_expects_to_fail() -> None:
    rows, proximity = with_wind_and_fog()
    (first,) = chosen(*bred(SPARSE, rows, proximity), np.zeros_like(proximity), 1)
    assert {"wind", "fog"} & acting(first.row[None])[0]
    assert max(first.proximity) > 0.6
    assert first.fails > 0.4


def test_what_flights_showed_already_is_chosen_less() -> None:
    rows, proximity = with_wind_and_fog()
    shown = (proximity >= 1).astype(float)
    # As if nobody had seen yet what fog does.
    shown[:, 1] = 0.0
    first = chosen(*bred(SPARSE, rows, proximity), shown, 10)
    names = acting(np.array([each.row for each in first]))
    assert sum("fog" in each for each in names) > 2 * sum("wind" in each for each in names)


def test_each_choice_differs_from_those_before() -> None:
    rows, proximity = with_wind_and_fog()
    found = chosen(*bred(SPARSE, rows, proximity), np.zeros_like(proximity), 12)
    assert len({each.row.tobytes() for each in found}) == 12
    names = acting(np.array([each.row for each in found]))
    assert any("wind" in each for each in names)
    assert any("fog" in each for each in names)


def test_a_choice_is_of_those_that_are_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "GENERATIONS", 1)
    brood, model = bred(SPARSE, flights(SPARSE, 12))
    choice, allowed = Choice(brood, model, np.zeros((12, len(PROPERTIES)))), np.zeros(60, bool)
    allowed[[3, 7]] = True
    best = [choice.best(allowed) for _ in range(2)]
    assert {each.row.tobytes() for each in best if each} == {
        brood.rows[place].tobytes() for place in (3, 7)
    }
    assert choice.best(allowed) is None
