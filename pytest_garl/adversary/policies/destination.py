"""destination: an NPC walks to the place that its genes give, and back."""

from __future__ import annotations

import numpy as np

from pytest_garl.adversary.steering import arrived, towards
from pytest_garl.errors import PolicyError
from pytest_garl.scenarios.placement import object_destination_m
from pytest_garl.simulation.npc_policy import Move, Situation


class Destination:
    """Walks from its start to the place that its genes say, back, and there again.

    For the paper's baselines whose objects have a start and an end, ``ga`` and ``offline-rl``;
    the module of ``ga`` says why they turn back.
    """

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Look the destination up; raise PolicyError for a scenario without one."""
        name = situation.self.name
        goal = object_destination_m(situation.scenario, situation.map, name)
        if goal is None:
            raise PolicyError(
                f"object policy 'destination': the scenario has no gene '{name}.destination_x'; "
                "choose a search method that gives NPCs a destination, such as ga (--garl-method), "
                "or another policy (--garl-npcs)"
            )
        x, y, _ = situation.self.position_m
        self._goal, self._next = goal, (x, y)

    def decide(self, situation: Situation) -> Move:
        """Go straight there; turn where the way ends."""
        if arrived(self._goal, situation):
            self._goal, self._next = self._next, self._goal
        return towards(self._goal, situation)


POLICY = Destination
