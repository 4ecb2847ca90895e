"""An NPC that sees the UAV in part, and begins when the learned director lets it go."""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import TYPE_CHECKING

import numpy as np

from pytest_garl.errors import PolicyError
from pytest_garl.messages import shown
from pytest_garl.npcs.decision_rules import Intercepting
from pytest_garl.npcs.director import Director, LearnedDirector, TimeToGo, Watch
from pytest_garl.npcs.director_progress import AND_EVENTS
from pytest_garl.npcs.event_watch import STRIKING, LearnedStrikes
from pytest_garl.npcs.interference import Interfering
from pytest_garl.scenarios.story import story_of, waits_for_decision
from pytest_garl.simulation.npc_policy import EventDirector, Move, Situation

if TYPE_CHECKING:
    from pytest_garl.npcs.learned import Network


class Directed(Interfering):
    """An interference whose begin is decided in flight, if its story waits for that.

    From its begin on it moves as one whose story names that time.  ``director`` says who decides,
    as :func:`director_of` reads it.
    """

    decides_begin = True

    @staticmethod
    def event_director(director: str = "") -> EventDirector | None:
        """Return what decides when events strike, as :func:`event_director_of` reads it."""
        return event_director_of(director)

    def __init__(self, grade: str, director: str = "") -> None:
        super().__init__(grade, Intercepting())
        self._director = director

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
        if math.isinf(self._began_s) and director_of(self._director).decides(
            self._watch.look(situation)
        ):
            self._began_s = situation.time_s
        known = (*situation.moments_s[:-1], self._began_s)
        move = super().decide(dataclasses.replace(situation, moments_s=known))
        return dataclasses.replace(move, begins=math.isfinite(self._began_s))


TIME_TO_GO = "time-to-go"
"""The first word of a text that names the rule in place of a network."""


@functools.lru_cache(maxsize=64)
def director_of(text: str) -> Director:
    """Return the director of NPCs that a text names, up to :data:`AND_EVENTS`.

    Empty: the weights that ship.  ``time-to-go 0.5 1``: that rule, with its margin and its time
    after an unseen UAV passed 3 m.  Else the weights of a network, as ``Network.text`` gives them.
    Raises PolicyError for a text that names none.
    """
    from pytest_garl.npcs.learned import learned_director, network_from

    text = text.partition(AND_EVENTS)[0]
    if not text:
        return learned_director()
    rule, *constants = text.split()
    if rule != TIME_TO_GO:
        return LearnedDirector(network=network_from(text))
    try:
        margin_s, unseen_s = map(float, constants)
    except ValueError as error:
        raise PolicyError(
            f"NPC policy: found the director {shown(text)}; expected '{TIME_TO_GO} MARGIN_S "
            "UNSEEN_S', two numbers"
        ) from error
    return TimeToGo(margin_s=margin_s, unseen_s=unseen_s)


def event_director_of(text: str) -> EventDirector | None:
    """Return the director of events that a text names after :data:`AND_EVENTS`, fresh for a flight.

    None without one: the fixed rule decides, which is what ships.
    """
    weights = text.partition(AND_EVENTS)[2]
    return LearnedStrikes(_event_network(weights)) if weights else None


@functools.lru_cache(maxsize=64)
def _event_network(weights: str) -> Network:
    from pytest_garl.npcs.learned import network_from

    return network_from(weights, STRIKING)
