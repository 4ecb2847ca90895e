"""destination: an NPC walks to the place that its genes give, and back."""

from __future__ import annotations

import numpy as np

from pytest_garl.errors import PolicyError
from pytest_garl.npcs.steering import arrived, towards
from pytest_garl.scenarios.placed import Placed
from pytest_garl.simulation.npc_policy import Move, Situation


class Destination:
    """Walks from its start to the destination in its genes and back, again and again.

    For the search methods of the paper that give NPCs a destination; the module of ``ga`` says why
    the NPC turns back.
    """

    reads_uav = False

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Look the destination up; raise PolicyError if the scenario has none."""
        name = situation.self.name
        goal = Placed(situation.scenario, situation.map).npc(name).destination_m
        if goal is None:
            raise PolicyError(
                f"NPC policy 'destination': the scenario has no gene '{name}.destination_x'; "
                "choose a search method that gives NPCs a destination, such as ga (--garl-method), "
                "or another policy (--garl-npcs)"
            )
        x, y, _ = situation.self.position_m
        self._goal, self._next = goal, (x, y)

    def decide(self, situation: Situation) -> Move:
        """Go straight there, and turn at the end of the way."""
        if arrived(self._goal, situation):
            self._goal, self._next = self._next, self._goal
        return towards(self._goal, situation)


POLICY = Destination
