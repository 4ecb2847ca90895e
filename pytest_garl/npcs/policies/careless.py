"""careless: an NPC walks straight across the landing place, and knows nothing of the UAV."""

from __future__ import annotations

import math

import numpy as np

from pytest_garl.npcs.exit_path import STUCK, ExitPath
from pytest_garl.npcs.interference import LEAVES_TO_M, drawn_story
from pytest_garl.scenarios.story import story_of
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, STAY, Move, Situation


class Careless:
    """Comes when its story says, crosses a point, may stand there for a while, and leaves.

    The story is in the scenario's genes.  In a scenario without, such as one of the paper, it is
    drawn.
    """

    grade = "careless"
    reads_uav = False

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Read the story."""
        told = story_of(situation.scenario, situation.self.name)
        self._story = told or drawn_story(self.grade, rng)
        self._crossed_s = math.inf
        self._move, self._exit = STAY, None
        self._place, self._waited = (math.inf, math.inf), 0

    _move: Move
    _exit: ExitPath | None
    _place: tuple[float, float]

    def decide(self, situation: Situation) -> Move:
        """Go straight to the crossing, stand, go straight on."""
        now, story = situation.time_s, self._story
        if now < story.begins_s(situation.moments_s):
            return STAY
        if self._exit is not None:
            return self._exit.decide(situation)
        (mx, my), (dx, dy) = situation.marker_position_m, story.crossing_m
        x, y, _ = situation.self.position_m
        ahead_x, ahead_y = mx + dx - x, my + dy - y
        distance = math.hypot(ahead_x, ahead_y)
        stride_m = situation.self.speed_mps * DECISION_STEP_S
        stands = story.pause_s > 0 and not situation.self.type.flies
        reached = distance < max(0.05, stride_m / 2, situation.self.type.turn_radius_m / 2)
        if math.isinf(self._crossed_s) and reached:
            self._crossed_s = now
        # Something solid stands in its way.
        is_stuck = math.dist((x, y), self._place) < STUCK * stride_m and not reached
        self._waited, self._place = (self._waited + 1 if is_stuck else 0), (x, y)
        if self._waited == 2:
            self._crossed_s = -math.inf
        if now >= self._crossed_s + (story.pause_s if stands else 0.0):
            self._exit = ExitPath(situation, (self._move.x, self._move.y), LEAVES_TO_M)
            return self._exit.decide(situation)
        if reached and stands:
            return STAY
        if distance > 0:
            # The last stride before a pause ends where it stands.
            share = min(1.0, distance / stride_m) if stands and stride_m > 0 else 1.0
            self._move = Move(x=ahead_x / distance, y=ahead_y / distance)
            return Move(x=share * self._move.x, y=share * self._move.y)
        return self._move


POLICY = Careless
