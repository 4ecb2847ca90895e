"""Training the director on tables."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")
from click.testing import CliRunner

from pytest_garl.cli import main
from pytest_garl.errors import PolicyError
from pytest_garl.npcs.director import AT, FEATURES, Features, LearnedDirector
from pytest_garl.npcs.gradient import StoppingRate
from pytest_garl.npcs.learned import learned_director, learned_spec, shipped
from pytest_garl.npcs.training.counterfactuals import MomentTable
from pytest_garl.npcs.training.director_training import (
    begin_of,
    best_rule,
    score_of,
    train_network,
)

NAN = float("nan")


def table(seed: int, decisions: int = 12) -> MomentTable:
    """Return a landing in which to begin pays if the UAV is between 3 and 5 m up.

    The rule thinks that there is time to spare up to the last three metres.
    """
    rows = np.zeros((decisions, len(FEATURES)))
    start_m = 7.0 + seed % 4
    heights = np.maximum(0.0, start_m - np.arange(decisions))
    rows[:, AT["height"]], rows[:, AT["sees"]] = heights / 10, 1.0
    rows[:, AT["spare"]], rows[:, AT["climb"]] = (heights - 3.0) / 5, -0.3
    pays = (heights >= 3) & (heights <= 5)
    meetings = [(8.0, 5.0, 9.0) if each else (NAN, NAN, 9.0) for each in pays[::2]]
    return MomentTable(
        seed=seed,
        kind="dog",
        grade="chasing",
        uav="straight",
        features=rows,
        meetings=np.array(meetings),
        never=np.array([NAN, NAN, 9.0]),
        descent_s=(0.0, 1.0, 2.0, 9.0),
        flown=0,
    )


class Below:
    """Goes below a height."""

    def __init__(self, height_m: float) -> None:
        self._height_m = height_m

    def decides(self, features: Features) -> bool:
        return bool(features[AT["height"]] * 10 <= self._height_m)


def test_a_director_is_judged_on_a_table_without_a_flight() -> None:
    tables = [table(seed) for seed in range(4)]
    assert [begin_of(Below(4.5), each) for each in tables] == [3, 4, 5, 6]
    assert begin_of(Below(-1.0), tables[0]) is None
    score = score_of(Below(4.5), tables)
    assert (score.episodes, score.collided, score.preventable) == (4, 4, 4)
    assert score.rate == 1.0
    assert score_of(Below(1.0), tables).rate == 0.0


def test_a_network_learns_when_to_go_from_the_best_rule_on() -> None:
    tables = [table(seed) for seed in range(4)]
    rule = best_rule(tables)
    assert score_of(rule, tables).preventable == 4
    assert 0.0 <= rule.margin_s <= 2.0
    network = train_network(tables, StoppingRate(imitates=40, steps=100, learning_rate=1e-2), 0)
    assert score_of(LearnedDirector(network=network), tables).preventable == 4


@pytest.mark.sim
def test_garl_train_writes_a_director(tmp_path: Path) -> None:
    out = tmp_path / "mine.npz"
    arguments = ["train", "--policy=director", "--map=court", "--type=child", "--uav=straight"]
    arguments += ["--episodes=2", "--seeds=2", "--validation=1", f"--out={out}"]
    result = CliRunner().invoke(main, [*arguments, f"--folder={tmp_path / 'folder'}"])
    assert result.exit_code == 0, result.output
    assert "reward in 1 validation episodes" in result.output
    manifest = json.loads(out.with_suffix(".json").read_text())
    assert manifest["state"] == "waiting"
    assert manifest["validation"].keys() == {"0", "1"}
    assert learned_director(out).decides(np.zeros(len(FEATURES))) in (True, False)
    with pytest.raises(PolicyError, match="decides when NPCs begin, and moves none"):
        learned_spec(str(out))


def test_a_policy_is_no_director() -> None:
    with pytest.raises(PolicyError, match="has the state 'belief'; expected 'waiting'"):
        learned_director(Path(shipped("chasing")))
