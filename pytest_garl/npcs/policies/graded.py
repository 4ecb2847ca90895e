"""graded: each NPC behaves in the grade that its story names."""

from __future__ import annotations

import numpy as np

from pytest_garl.errors import PolicyError
from pytest_garl.npcs.directed import Directed
from pytest_garl.scenarios.story import GRADES, story_of
from pytest_garl.simulation.npc_policy import Move, NpcPolicy, Situation


class Graded:
    """Lets the policy of an NPC's own grade decide; domains that name a grade move NPCs so."""

    grade = ""
    decides_begin = True
    event_director = staticmethod(Directed.event_director)

    def __init__(self, director: str = "") -> None:
        self._director = director

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Make the policy of the grade; raise PolicyError if the scenario has no story."""
        from pytest_garl.npcs.policy_catalogue import policy_spec

        name = situation.self.name
        story = story_of(situation.scenario, name)
        if story is None:
            raise PolicyError(
                f"NPC policy 'graded': the scenario says no grade for {name}; choose a domain "
                f"whose npc_behaviour is one of {', '.join(GRADES)}, or --garl-npcs=GRADE"
            )
        self._policy: NpcPolicy = policy_spec(story.grade).directed_by(self._director).make()
        self._policy.reset(situation, rng)

    def decide(self, situation: Situation) -> Move:
        """Return that policy's move."""
        return self._policy.decide(situation)


POLICY = Graded
