"""An NPC that sees the UAV in part: it comes, interferes for a while, and leaves."""

from __future__ import annotations

import dataclasses
import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from pytest_garl.npcs.exit_path import ExitPath
from pytest_garl.npcs.grades import GRADE_LIMITS, GradeLimits
from pytest_garl.npcs.steering import towards
from pytest_garl.scenarios.bodies import Disc, discs_of
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.story import APPROACH_S, LIMITS_S, Story, story_of
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, STAY, Move, Situation

LEAVES_TO_M = 15.0
"""An NPC leaves to at least this distance from the marker: out of sight of the UAV above it."""
DRAWN_DELAY_S = 10.0
"""If the scenario has no story, an NPC comes at most this long after its phase."""
DRAWN_REACH_M = 3.0
"""If the scenario has no story, a careless NPC crosses at most this far from the marker."""
_MARGIN_M = 0.01
"""A disc that lies at most this much farther from a line than it reaches is examined closely."""
Vector = tuple[float, float, float]


class Sighting(NamedTuple):
    """Place and velocity of the UAV as an NPC perceived it; ``age_s`` is how long ago that was."""

    position_m: Vector
    velocity_mps: Vector
    age_s: float

    @property
    def place_m(self) -> tuple[float, float]:
        """Where the NPC believes the UAV to be: straight on from where it saw it."""
        (x, y, _), (vx, vy, _) = self.position_m, self.velocity_mps
        return x + vx * self.age_s, y + vy * self.age_s

    @property
    def height_m(self) -> float:
        """How high the NPC believes the UAV to fly."""
        return max(0.0, self.position_m[2] + self.velocity_mps[2] * self.age_s)


class Perception:
    """The UAV as one NPC perceives it; show it every situation of a decision."""

    def __init__(self, limits: GradeLimits, map: Map) -> None:
        self._limits = limits
        self._discs = tuple(disc for body in map.bodies for disc in discs_of(body))
        self._middles = np.array([(disc.x_m, disc.y_m) for disc in self._discs]).reshape(-1, 2).T
        self._reaches = np.array([disc.radius_m for disc in self._discs]) + _MARGIN_M
        late = round(limits.delay_s / DECISION_STEP_S)
        self._seen: deque[tuple[Vector, Vector] | None] = deque(maxlen=late + 1)

    def update(self, situation: Situation) -> None:
        """Look at the UAV."""
        found = None
        if self._is_in_sight(situation):
            found = (situation.uav_position_m, situation.uav_velocity_mps)
        self._seen.append(found)

    @property
    def sighting(self) -> Sighting | None:
        """What the NPC perceives; None if it saw nothing at that moment."""
        if len(self._seen) < (self._seen.maxlen or 1) or self._seen[0] is None:
            return None
        position, velocity = self._seen[0]
        return Sighting(position, velocity, self._limits.delay_s)

    def _is_in_sight(self, situation: Situation) -> bool:
        x, y, z = situation.self.position_m
        # From the eyes, near its highest point.
        eye = (x, y, max(z, situation.self.top_m - 0.1))
        if math.dist(eye, situation.uav_position_m) > self._limits.sees_within_m:
            return False
        thing = situation.uav_position_m
        return not any(_stands_between(disc, eye, thing) for disc in self._near(eye, thing))

    def _near(self, eye: Vector, thing: Vector) -> Sequence[Disc]:
        """Return the discs that lie near the line between two points, seen from above."""
        (x, y, _), (dx, dy, _) = eye, tuple(b - a for a, b in zip(eye, thing, strict=True))
        ahead, aside = self._middles[0] - x, self._middles[1] - y
        along = (ahead * dx + aside * dy) / max(dx * dx + dy * dy, 1e-12)
        along = np.minimum(np.maximum(along, 0.0), 1.0)
        ahead, aside = ahead - along * dx, aside - along * dy
        near = ahead * ahead + aside * aside <= self._reaches * self._reaches
        return [self._discs[number] for number in np.flatnonzero(near)]


def _stands_between(disc: Disc, eye: Vector, thing: Vector) -> bool:
    """Whether the line between two points passes through an upright cylinder."""
    (x, y, z), (dx, dy, dz) = eye, tuple(b - a for a, b in zip(eye, thing, strict=True))
    length = dx * dx + dy * dy
    along = ((disc.x_m - x) * dx + (disc.y_m - y) * dy) / length if length > 0 else 0.0
    if not 0 < along < 1:
        return False
    away = math.hypot(x + along * dx - disc.x_m, y + along * dy - disc.y_m)
    return away < disc.radius_m and disc.low_m < z + along * dz < disc.high_m


@dataclass(frozen=True, slots=True, kw_only=True)
class Belief(Situation):
    """A situation as an NPC believes it to be: with the UAV where it was seen, moved on.

    ``left_s`` is how long the NPC still interferes, ``keeps_m`` what it keeps from the UAV.
    """

    left_s: float
    keeps_m: float


class DecisionRule(Protocol):
    """Decides where an NPC goes that perceives the UAV in part."""

    def decide(self, belief: Belief) -> Move:
        """Return the move until the next decision of its grade."""


class Interference:
    """The part of one NPC without its decisions: when it comes, what it perceives, when it leaves.

    It comes after its phase and goes to the marker until it perceives the UAV.  From then on it
    interferes, until its time is over or it perceived nothing for :data:`APPROACH_S`; it leaves.
    """

    def __init__(self, grade: str, situation: Situation, rng: np.random.Generator) -> None:
        told = story_of(situation.scenario, situation.self.name)
        self._story = told or drawn_story(grade, rng)
        self._limits: GradeLimits = GRADE_LIMITS[grade]
        self._lasts_s = min(self._story.lasts_s, LIMITS_S[grade])
        self._perception = Perception(self._limits, situation.map)
        self._exit: ExitPath | None = None
        self._move = STAY
        self._asked_s = -math.inf
        self._ends_s = math.inf

    @property
    def is_over(self) -> bool:
        """Whether it is leaving."""
        return self._exit is not None

    def look(self, situation: Situation) -> Belief | None:
        """Take a situation in; return what the NPC believes if it decides now."""
        self._perception.update(situation)
        now, begins_s = situation.time_s, self._story.begins_s(situation.moments_s)
        if now < begins_s or self._exit is not None:
            return None
        sighting = self._perception.sighting
        if math.isinf(self._ends_s) and sighting is not None:
            self._ends_s = now + self._lasts_s
        if now >= min(self._ends_s, begins_s + APPROACH_S + self._lasts_s):
            # One that keeps away from the UAV turns back; another one goes straight on.
            last = (self._move.x, self._move.y) if self._limits.keeps_m == 0 else (0.0, 0.0)
            self._exit = ExitPath(situation, last, LEAVES_TO_M)
            return None
        if now - self._asked_s < self._limits.decides_every_s - 1e-6:
            return None
        if sighting is None:
            self._move = towards(situation.marker_position_m, situation)
            return None
        self._asked_s = now
        return _belief(sighting, situation, self._ends_s - now, self._limits.keeps_m)

    def answer(self, move: Move) -> None:
        """Take the decision that follows from what the NPC believed."""
        self._move = move

    def move(self, situation: Situation) -> Move:
        """Return the move until the next situation."""
        move = self._move if self._exit is None else self._exit.decide(situation)
        return kept_away(move, self._perception.sighting, situation, self._limits.keeps_m)


class Interfering:
    """An NPC policy: an interference with a rule of decision."""

    def __init__(self, grade: str, rule: DecisionRule) -> None:
        self.grade, self._rule = grade, rule

    @property
    def is_over(self) -> bool:
        """Whether the NPC is leaving."""
        return self._interference.is_over

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Read the story, or draw one."""
        self._interference = Interference(self.grade, situation, rng)

    def decide(self, situation: Situation) -> Move:
        """Return the move until the next decision."""
        belief = self._interference.look(situation)
        if belief is not None:
            self._interference.answer(self._rule.decide(belief))
        return self._interference.move(situation)


def _belief(sighting: Sighting, situation: Situation, left_s: float, keeps_m: float) -> Belief:
    facts = {each.name: getattr(situation, each.name) for each in dataclasses.fields(Situation)}
    facts["uav_position_m"] = (*sighting.place_m, sighting.height_m)
    facts["uav_velocity_mps"] = sighting.velocity_mps
    return Belief(**facts, left_s=left_s, keeps_m=keeps_m)


def kept_away(move: Move, sighting: Sighting | None, situation: Situation, keeps_m: float) -> Move:
    """Return the move, or another one if it leads nearer to the UAV's column than ``keeps_m``.

    An NPC that would come too near stands; a bird, which cannot, flies away from there.
    """
    if sighting is None or keeps_m == 0:
        return move
    (x, y, _), (ux, uy) = situation.self.position_m, sighting.place_m
    stride_m = situation.self.speed_mps * DECISION_STEP_S
    after = math.dist((x + move.x * stride_m, y + move.y * stride_m), (ux, uy))
    before = math.dist((x, y), (ux, uy))
    if after >= keeps_m or after > before:
        return move
    if not situation.self.type.flies or before == 0:
        return STAY
    return Move(x=(x - ux) / before, y=(y - uy) / before)


def drawn_story(grade: str, rng: np.random.Generator) -> Story:
    """Draw a story for an NPC of a scenario that has none, such as one of the paper."""
    angle, reach = rng.uniform(0, 2 * math.pi), DRAWN_REACH_M * math.sqrt(rng.uniform())
    return Story(
        grade=grade,
        phase=int(rng.integers(0, 3)),
        delay_s=float(rng.uniform(0, DRAWN_DELAY_S)),
        lasts_s=LIMITS_S[grade],
        crossing_m=(reach * math.cos(angle), reach * math.sin(angle)),
    )
