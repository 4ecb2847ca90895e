"""An NPC that sees the UAV in part, and begins when the learned director lets it go."""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np

from pytest_garl.npcs.director import Director, Watch
from pytest_garl.npcs.interference import Interfering
from pytest_garl.scenarios.story import story_of, waits_for_decision
from pytest_garl.simulation.npc_policy import Move, Situation


class Directed(Interfering):
    """An interference whose begin is decided in flight, if its story waits for that.

    From its begin on it moves as one whose story names that time.
    """

    decides_begin = True

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Read the story, or draw one."""
        super().reset(situation, rng)
        story = story_of(situation.scenario, situation.self.name)
        self._watch, self._began_s = None, math.inf
        if story is not None and waits_for_decision(story):
            self._watch = Watch(situation, dataclasses.replace(story, grade=self.grade))

    _watch: Watch | None

    def decide(self, situation: Situation) -> Move:
        """Return the move until the next decision."""
        if self._watch is None:
            return super().decide(situation)
        if math.isinf(self._began_s) and shipped_director().decides(self._watch.look(situation)):
            self._began_s = situation.time_s
        known = (*situation.moments_s[:-1], self._began_s)
        move = super().decide(dataclasses.replace(situation, moments_s=known))
        return dataclasses.replace(move, begins=math.isfinite(self._began_s))


@functools.cache
def shipped_director() -> Director:
    """Return the director with the weights that ship."""
    from pytest_garl.npcs.learned import learned_director

    return learned_director()
