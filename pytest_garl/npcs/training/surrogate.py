"""The surrogate: Gymnasium environments about one NPC, on the project's own simulator and camera.

:class:`SurrogateEnv` flies from take-off to landing, :class:`GradedEnv` only the part of a landing
in which an NPC with a grade decides.
"""

from __future__ import annotations

import functools
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from pytest_garl.npcs.encodings import ENCODINGS, LIMIT
from pytest_garl.npcs.interference import Belief, Interference
from pytest_garl.npcs.training import rewards
from pytest_garl.npcs.training.episode import Episode, draw_episode, in_any_environment
from pytest_garl.npcs.training.graded_landing import draw_graded_landing
from pytest_garl.npcs.training.presets import Surrogate
from pytest_garl.npcs.training.uav_models import (
    AvoidanceParameters,
    AvoidingPilot,
    FlightStyle,
    StraightPilot,
)
from pytest_garl.simulation.npc_policy import Move, Situation

Observation = NDArray[np.float32]
AFTERMATH_STEPS = 3
"""Half seconds for which an episode goes on after the NPC's time: a collision may follow."""
_TRIES = 100


class OneNpcEnv(gymnasium.Env[Observation, np.int64]):
    """An environment whose observation and actions are those of a surrogate's encoding."""

    def __init__(self, surrogate: Surrogate) -> None:
        self.surrogate = surrogate
        self._encoding = ENCODINGS[surrogate.state]
        self.observation_space = gymnasium.spaces.Box(
            -LIMIT, LIMIT, (self._encoding.size,), np.float32
        )
        self.action_space = gymnasium.spaces.Discrete(self._encoding.actions)
        self._episode: Episode | None = None

    def close(self) -> None:
        """Free the physics of the last episode."""
        if self._episode is not None:
            self._episode.close()
            self._episode = None

    def _current(self) -> Episode:
        if self._episode is None:
            raise gymnasium.error.ResetNeeded("reset() comes before the first step()")
        return self._episode


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
        """Move the NPC for 0.5 s; raise ResetNeeded before the first ``reset``."""
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


class GradedEnv(OneNpcEnv):
    """One NPC that decides while it perceives the UAV; a step is one decision of its grade.

    The observation and the actions are those of the encoding ``belief``.  ``info`` holds
    ``collided`` and ``outcome``.  An episode ends with the flight, or shortly after the NPC began
    to leave; a step after the end changes nothing.
    """

    def __init__(self, surrogate: Surrogate) -> None:
        super().__init__(surrogate)
        self.belief: Belief | None = None
        self._state = np.zeros(self._encoding.size, np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Draw episodes until the NPC of one perceives the UAV; the same seed draws the same.

        Raises RuntimeError if 100 episodes are in vain.
        """
        super().reset(seed=seed)
        for _ in range(_TRIES):
            self.close()
            self._begin()
            if self._fly_to_decision():
                return self._state, self._info()
        raise RuntimeError(f"no NPC perceived the UAV in {_TRIES} episodes")

    def step(self, action: np.int64) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Let the NPC follow its decision until the next one."""
        if self.belief is None:
            return self._state, 0.0, True, False, self._info()
        return self.follow(self._encoding.moves(self.belief)[int(action)])

    def follow(self, move: Move) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Let the NPC make a move, which need not be an action, until its next decision.

        Raises ResetNeeded before the first ``reset``.
        """
        episode, before = self._current(), self._distance_m()
        self._interference.answer(move)
        goes_on = self._fly_to_decision()
        reward = rewards.collision_first(
            before,
            self._distance_m(),
            collided=episode.hit is not None,
            ended=not goes_on,
            discount=self.surrogate.discount,
        )
        return self._state, reward, not goes_on, False, self._info()

    def _begin(self) -> None:
        landing = draw_graded_landing(self.surrogate, self.np_random)
        self._episode = landing.begin()
        self._interference = Interference(
            landing.grade, self._episode.situations[0], self.np_random
        )
        self._first = True

    def _fly_to_decision(self) -> bool:
        """Fly until the NPC decides; return False if the episode ended before."""
        episode, left = self._current(), AFTERMATH_STEPS
        while left > 0:
            if not self._first:
                episode.step([self._interference.move(episode.situations[0])])
            self._first = False
            if episode.outcome is not None:
                break
            belief = self._interference.look(episode.situations[0])
            if belief is not None:
                self.belief, self._state = belief, self._encoding.state(belief)
                return True
            left -= self._interference.is_over
        self.belief = None
        return False

    def _info(self) -> dict[str, Any]:
        episode = self._current()
        return {"outcome": episode.outcome or "", "collided": episode.hit is not None}

    def _distance_m(self) -> float:
        situation: Situation = self._current().situations[0]
        return rewards.column_distance_m(situation.self.position_m, situation.uav_position_m)


def env_of(surrogate: Surrogate) -> GradedEnv | SurrogateEnv:
    """Return the environment of a surrogate."""
    return GradedEnv(surrogate) if surrogate.grades else SurrogateEnv(surrogate)
