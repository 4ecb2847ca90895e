"""The table of who decides when an NPC begins."""

from __future__ import annotations

import pytest

pytest.importorskip("torch")
from lab.moments import (
    AtHeight,
    after_sight,
    as_gene,
    best,
    decided_by,
    deciders,
    hits,
    report,
)
from pytest_garl.npcs.director import AT, FEATURES, WAITING
from pytest_garl.npcs.gradient import untrained
from pytest_garl.npcs.training.counterfactuals import COLLIDED, PREVENTABLE, MomentTable
from tests.npcs.training.test_director_training import table

TABLES = [table(seed) for seed in range(4)]


def test_rules_begin_where_they_say() -> None:
    late: MomentTable = TABLES[0]
    late.features[:3, AT["sees"]] = 0
    assert after_sight(1.5)(late) == 3 + 3
    assert after_sight(30.0)(late) is None
    # It is 7 m up and sinks by 1 m in each decision.
    assert decided_by(AtHeight(height_m=3.2))(late) == 4
    late.features[:3, AT["sees"]] = 1
    numbers = [as_gene(each) for each in TABLES]
    assert numbers == [as_gene(each) for each in TABLES]
    assert all(number is None or number < len(late.features) for number in numbers)


def test_nobody_hits_more_than_who_knows_the_end() -> None:
    network = untrained(WAITING, (len(FEATURES), 4, 2), seed=0)
    most = hits(best(PREVENTABLE), TABLES, PREVENTABLE)
    assert most == 4
    for each in deciders(TABLES, PREVENTABLE, network):
        assert hits(each.begins, TABLES, PREVENTABLE) <= most
    height = next(each for each in deciders(TABLES, COLLIDED, network) if "height" in each.name)
    assert height.constants == "3 m", "the first that hits in all"
    assert hits(height.begins, TABLES, COLLIDED) == 4


def test_the_report_counts_the_npcs_that_chase() -> None:
    row = {
        "tuned_for": "any collision",
        "decider": "somebody",
        "constants": "1 s",
        "grade": "chasing",
        "uav": "straight",
        "landings": "30",
        "collided": "6",
        "preventable": "3",
    }
    text = report([row, row | {"uav": "avoiding"}, row | {"grade": "curious", "collided": "30"}])
    assert "| somebody | 1 s | 60 | 20.0 % [" in text
    assert "| 3 / 3 |" in text
