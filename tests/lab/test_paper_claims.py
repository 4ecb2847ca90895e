"""The paper's claims: what rows say of each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest

from lab.experiment.results import ResultRow
from lab.paper_claims import CLAIMS, NOT_FLOWN, RIVALS, claim_lines
from tests.lab.experiment.samples import row

PAIRS = [(map, seed) for map in ("court", "lawn") for seed in (0, 1, 2)]


def finding(text: str, rows: Sequence[ResultRow]) -> tuple[str, str]:
    (claim,) = (each for each in CLAIMS if text in each.text)
    return claim.judge(rows)


def searches(method: str = "garl-paper", system: str = "MM-MLS", **values: Any) -> list[ResultRow]:
    return [
        row(system=system, method=method, map=map, seed=seed, budget=400, **values)
        for map, seed in PAIRS
    ]


def test_without_rows_no_claim_has_a_verdict() -> None:
    assert {line[1:] for line in claim_lines([])} == {NOT_FLOWN}


@pytest.mark.parametrize(
    ("other", "verdict"), [(200, "reproduced"), (240, "not reproduced"), (280, "not reproduced")]
)
def test_a_system_fails_more_often_in_all_pairs_or_not(other: int, verdict: str) -> None:
    rows = searches(system="OpenCV-MLS", its_code=240) + searches(
        system="TPHYolo-MLS", its_code=other
    )
    assert finding("OpenCV-MLS fails more often", rows)[1] == verdict


def test_three_pairs_show_a_direction_only() -> None:
    rows = searches(system="OpenCV-MLS", its_code=240) + searches(
        system="TPHYolo-MLS", its_code=200
    )
    court = [each for each in rows if each.map == "court"]
    assert finding("OpenCV-MLS fails more often", court) == (
        "+10.0 (3 pairs, p = 0.25)",
        "in direction",
    )


def test_garl_is_above_all_only_if_it_is_above_its_strongest_rival() -> None:
    rows = searches(its_code=120, its_top10=20)
    for method in RIVALS:
        rows += searches(method=method, its_code=140 if method == "random" else 80, its_top10=40)
    assert finding("finds the most violations", rows) == (
        "random: -5.0 (6 pairs, p = 0.03)",
        "not reproduced",
    )
    assert finding("finds ten the soonest", rows)[1] == "reproduced"
    some = [each for each in rows if each.method in ("garl-paper", "ga")]
    assert finding("finds the most violations", some) == (
        "ga: +10.0 (6 pairs, p = 0.03); 1 of 5 rivals",
        "reproduced",
    )


def test_most_violations_are_of_a_type_in_each_search_or_in_all_together() -> None:
    none: dict[str, Any] = {f"type_{name}": 0 for name in ("i", "ii", "iii", "iv", "v")}
    rows = searches(system="OpenCV-MLS", **none | {"type_ii": 30, "type_iv": 10})
    text = "on the court OpenCV-MLS mostly fails to detect"
    assert finding(text, rows) == ("75 % of them; in 3 of 3 searches", "reproduced")
    lawn = [each for each in rows if each.map == "lawn"]
    assert finding("on the lawn most violations are collisions", lawn)[1] == "not reproduced"
    rows[0] = row(system="OpenCV-MLS", method="garl-paper", **none | {"type_iv": 10})
    assert finding(text, rows) == ("67 % of them; in 2 of 3 searches", "in direction")


def test_a_rival_that_collides_refutes_that_only_the_agent_does() -> None:
    rows = searches() + searches(method="surrogate-random") + searches(method="random", type_iv=0)
    text = "only GARL and the agent without the GA"
    assert finding(text, rows) == ("random 6", "not reproduced")
    assert finding(text, [*rows[:12], *searches("random", type_iv=0, type_v=0)])[1] == "reproduced"


@pytest.mark.parametrize(
    ("paper", "verdict"), [(84, "in direction"), (100, "not reproduced"), (70, "not reproduced")]
)
def test_hardly_above_is_above_by_two_points_at_most(paper: int, verdict: str) -> None:
    rows = searches("random", its_code=80) + searches("ga", its_code=paper)
    assert finding("hardly better than random", rows)[1] == verdict


def test_the_agent_is_near_if_it_is_nearer_than_random() -> None:
    rows = searches(its_code=120) + searches("random", its_code=60)
    assert (
        finding("comes near", rows + searches("surrogate-random", its_code=100))[1]
        == "in direction"
    )
    assert (
        finding("comes near", rows + searches("surrogate-random", its_code=50))[1]
        == "not reproduced"
    )


def test_a_longer_search_is_seen() -> None:
    rows = searches() + searches("random")
    assert finding("lasts about as long", rows) == ("1.00 to 1.00 times (6 pairs)", "reproduced")
    assert finding("lasts about as long", searches(flying_s=9500.0) + rows[6:])[1] == (
        "not reproduced"
    )
    assert finding("all types", rows)[1] == "not reproduced"
    assert finding("all types", searches(type_iii=1))[1] == "reproduced"
