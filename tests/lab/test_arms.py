"""The arms: which scenarios they draw, and who lets NPCs begin in them."""

from __future__ import annotations

import numpy as np
import pytest

from lab.arms import ARMS, DOMAIN, FROZEN, arm_named, decided_by, without_decisions
from pytest_garl.errors import GarlError
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.groups import DECIDED
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.story import STORY, STORY_MOMENTS
from pytest_garl.search.method import SearchPlan
from tests.support.stories import scenario_with, walk

MAP = load_map("lawn")
PLAN = SearchPlan(map=MAP, genome=genome_of(DOMAIN, MAP), seed=200, flights=400, population=20)
OURS = [name for name in ARMS if name != FROZEN]
AT_DECISION = STORY_MOMENTS.index(DECIDED)


@pytest.mark.parametrize("name", [*OURS, "rule@1.5"])
def test_all_arms_have_the_same_control(name: str) -> None:
    control = [dump_scenario(each) for each in arm_named("random").make(PLAN).ask()]
    own = [dump_scenario(each) for each in arm_named(name).make(PLAN).ask()]
    alike = sum(one == other for one, other in zip(own, control, strict=True))
    # In a scenario without NPCs nothing begins.
    assert alike == 20 if name != "gene" else 0 < alike < 20


def test_no_story_of_the_arm_gene_waits_for_a_decision() -> None:
    genome, rng = without_decisions(PLAN.genome), np.random.default_rng(1)
    columns = [place for place, key in enumerate(genome.keys) if key.endswith(".phase")]
    rows = np.array([genome.random_active(rng, ["dog-1", "bird-1"]) for _ in range(200)])
    drawn = {STORY["phase"].flown(value) for value in rows[:, columns].ravel()}
    assert drawn == {*map(float, range(AT_DECISION))}
    assert genome.keys == PLAN.genome.keys


def begins_s(arm: str) -> float:
    """Return when a chasing person begins whose story waits for a decision, under a UAV."""
    story = {"grade": 2.0, "phase": float(AT_DECISION), "lasts_s": 5.0}
    policy = arm_named(arm).npcs.make()
    places = walk(
        scenario_with("person-1", (-3.0, 0.0), 3.0, story),
        "person-1",
        seconds=8,
        uav=lambda time_s: (0.0, 0.0, max(2.0, 9.0 - time_s)),
        uav_mps=(0.0, 0.0, -1.0),
        policy=policy,
    )
    moved = np.abs(places[:, 0] + 3.0) > 0.01
    return float(moved.argmax()) / 60 if moved.any() else float("inf")


def test_the_rule_lets_npcs_begin_earlier_with_a_larger_margin() -> None:
    late, early = begins_s("rule@-1"), begins_s("rule@3")
    assert early + 2.0 < late
    assert begins_s("rule") != pytest.approx(late)


def test_the_untrained_network_is_another_one_than_the_one_that_ships() -> None:
    assert begins_s("untrained") not in (begins_s("rule"), begins_s("garl"))
    assert decided_by("garl") == policy_spec("graded")
    assert decided_by("untrained") == decided_by("untrained") != decided_by("garl")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("exploring", "is flown by commit"),
        ("evolving", "unknown arm 'evolving'; expected one of random, "),
        ("garl@1.5", "unknown arm 'garl@1.5'"),
    ],
)
def test_an_arm_that_cannot_be_made_is_named(name: str, message: str) -> None:
    with pytest.raises(GarlError, match=message):
        arm_named(name)
