"""The surrogate: a Gymnasium environment on the project's own simulator and camera."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from pytest_garl.npcs.training import rewards
from pytest_garl.npcs.training.episode import Episode, draw_episode, in_any_environment
from pytest_garl.npcs.training.one_npc_env import Observation, OneNpcEnv
from pytest_garl.npcs.training.uav_models import (
    AvoidanceParameters,
    AvoidingPilot,
    FlightStyle,
    StraightPilot,
)


class SurrogateEnv(OneNpcEnv):
    """One NPC, a marker at a fixed place, a UAV from take-off to landing or collision.

    Actions are those of the state's encoding, one every 0.5 s; the observation is its vector.
    ``info`` holds ``collided``, ``outcome`` and, with the paper's reward, ``hidden``, the share of
    the marker in the frame that is covered.  A step after the end changes nothing.
    """

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Draw an episode; the same seed draws the same."""
        super().reset(seed=seed)
        self.close()
        rng, surrogate = self.np_random, self.surrogate
        map = surrogate.maps[int(rng.integers(len(surrogate.maps)))]
        type_name = surrogate.types[int(rng.integers(len(surrogate.types)))]
        scenario, place = draw_episode(map, [type_name], rng)
        if surrogate.environment == "drawn":
            scenario = in_any_environment(scenario, place, rng)
        avoiding = rng.random() < {"straight": 0.0, "both": 0.5, "avoiding": 1.0}[surrogate.uav]
        # The paper's UAV always flies the same way; ours differ as much as landing systems do.
        style = FlightStyle() if surrogate.uav == "straight" else FlightStyle.drawn(rng)
        pilot: Any = functools.partial(StraightPilot, style)
        if avoiding:
            pilot = functools.partial(AvoidingPilot, style, AvoidanceParameters.drawn(rng))
        pilot.airframe = surrogate.airframe
        camera = surrogate.airframe.camera if surrogate.reward == "paper" else None
        self._episode = Episode(scenario, place, pilot, camera=camera)
        return self._observe()

    def step(self, action: np.int64) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Move the NPC for 0.5 s."""
        episode = self._current()
        if episode.outcome is not None:
            observation, info = self._observe()
            return observation, 0.0, True, False, info
        before = self._distance_m()
        moves = self._encoding.moves(episode.situations[0])
        episode.step([moves[int(action)]])
        observation, info = self._observe()
        collided = bool(info["collided"])
        late = info["outcome"] == "not_landed"
        ended = bool(info["outcome"]) and not late
        if self.surrogate.reward == "paper":
            expected, seen = episode.marker_pixels()
            reward = rewards.paper(expected, seen, collided=collided)
            info["hidden"] = 1 - seen / expected if expected else 0.0
        else:
            reward = rewards.collision_first(
                before,
                self._distance_m(),
                collided=collided,
                ended=ended,
                discount=self.surrogate.discount,
            )
        return observation, reward, ended, late, info

    def _observe(self) -> tuple[Observation, dict[str, Any]]:
        episode = self._current()
        observation = self._encoding.state(episode.situations[0])
        return observation, {"outcome": episode.outcome or "", "collided": episode.hit is not None}

    def _distance_m(self) -> float:
        situation = self._current().situations[0]
        return rewards.column_distance_m(situation.self.position_m, situation.uav_position_m)
