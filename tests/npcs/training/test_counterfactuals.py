"""Tables of how a landing ends for each moment at which its NPC begins."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from pytest_garl.npcs.director import FEATURES
from pytest_garl.npcs.training import counterfactuals
from pytest_garl.npcs.training.counterfactuals import (
    COLLIDED,
    EARLY_S,
    GROUNDED,
    HARMLESS,
    PREVENTABLE,
    STRIDE,
    MomentTable,
    drawn_table,
    table_of,
)
from pytest_garl.npcs.training.graded_landing import draw_graded_landing
from pytest_garl.npcs.training.presets import PRESETS, Uav
from pytest_garl.scenarios.story import story_of
from pytest_garl.simulation.npc_policy import DECISION_STEP_S
from tests.npcs.training.surrogates import COURT

DIRECTOR = dataclasses.replace(PRESETS["director"].surrogate, maps=COURT)
CHASED = dataclasses.replace(DIRECTOR, types=("child",), grades=("chasing",), takes_off=0.0)
NAN = math.nan


def made(*meetings: tuple[float, float, float], decisions: int = 6) -> MomentTable:
    """Return a table by hand."""
    return MomentTable(
        seed=0,
        kind="dog",
        grade="chasing",
        uav="straight",
        features=np.zeros((decisions, len(FEATURES))),
        meetings=np.array(meetings),
        never=np.array([NAN, NAN, 9.0]),
        descent_s=(0.0, 1.0, 2.0, 9.0),
        flown=0,
    )


def test_an_end_is_what_a_contact_means() -> None:
    table = made(
        (NAN, 3.0, 9.0), (9.5, 3.0, 9.0), (8.0, 7.5, 9.0), (8.0, 5.0, 9.0), (8.0, NAN, 9.0)
    )
    assert table.ends.tolist() == [HARMLESS, GROUNDED, COLLIDED, PREVENTABLE, COLLIDED]
    assert [table.end_of(number) for number in (0, 1, 2, 3, None)] == [0, 0, 1, 1, HARMLESS]


@pytest.mark.sim
@pytest.mark.parametrize("uav", ["straight", "avoiding"])
def test_what_geometry_says_of_a_moment_is_what_a_landing_shows(uav: Uav) -> None:
    surrogate = dataclasses.replace(CHASED, uav=uav)
    landing = draw_graded_landing(surrogate, np.random.default_rng(5))
    table = table_of(5, landing)
    assert len(table.meetings) == math.ceil(len(table.features) / STRIDE)
    assert table.flown < len(table.meetings)
    hits = np.flatnonzero(table.ends > HARMLESS).tolist()
    for number in {*hits[:1], len(table.meetings) // 2}:
        moment_s = number * STRIDE * DECISION_STEP_S - EARLY_S
        contact_s, seen_s, _ = counterfactuals._flown(landing, moment_s)
        for flown, told in zip((contact_s, seen_s), table.meetings[number], strict=False):
            assert flown is None or told == pytest.approx(flown, abs=0.1)
        assert (contact_s is None) == np.isnan(table.meetings[number][0])
    assert (table.uav, table.kind, table.grade) == (uav, "child", "chasing")


@pytest.mark.sim
def test_a_table_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    surrogate = dataclasses.replace(CHASED, uav="straight")
    table = drawn_table(surrogate, 7, tmp_path)
    monkeypatch.delattr(counterfactuals, "table_of")
    again = drawn_table(surrogate, 7, tmp_path)
    for field in dataclasses.fields(MomentTable):
        one, other = (np.array(getattr(each, field.name)) for each in (table, again))
        assert (
            one.tolist() == other.tolist() or (one[~np.isnan(one)] == other[~np.isnan(other)]).all()
        )


def test_most_landings_begin_in_the_air() -> None:
    modes = []
    for seed in range(20):
        landing = draw_graded_landing(DIRECTOR, np.random.default_rng(seed))
        modes.append(landing.scenario.task.start.mode)
        story = story_of(landing.scenario, landing.npc)
        assert story is not None
        assert story.grade == landing.grade
        assert landing.grade in ("chasing", "curious")
    assert 1 <= modes.count("ground") <= 10
    assert set(modes) == {"ground", "hover"}
