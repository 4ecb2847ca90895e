"""The story of an NPC: how much it knows of the UAV, when it comes, what it does, how long.

Scenarios of domains that name a grade have a story for each NPC; those of the paper have none.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from pytest_garl.scenarios.groups import DECIDED, MOMENTS
from pytest_garl.scenarios.quantities import Quantity
from pytest_garl.scenarios.scenario import Scenario

GRADES = ("careless", "curious", "chasing", "hostile")
"""Grades of behaviour from the weakest to the strongest (:mod:`pytest_garl.npcs.grades`)."""
MET = "met"
STORY_MOMENTS = (*MOMENTS, MET, DECIDED)
"""What a story waits for: a moment of the landing; the last one at which the NPC can still reach
the UAV before that is down where the NPC is; or the decision of the learned director
(:mod:`pytest_garl.npcs.director`).  A delay counts from there, but for a decision."""
_IN_WORDS = (
    "the flight begins",
    "the UAV passes 8 m",
    "the UAV passes 3 m",
    "the UAV touches down",
    "the marker can be read for the first time",
    "the marker can no longer be read",
    "it can just meet the UAV",
    "the director lets it go",
)
CURIOUS_S = 20.0
"""Longest interference of a curious NPC: engineering estimate of how long somebody looks at a UAV
that lands before walking on."""
CHASE_S = 5.0
"""Longest chase, as the design of the grades says."""
APPROACH_S = 10.0
"""An NPC that has come, and perceives no UAV for this time, leaves: engineering estimate."""
WALKERS_AND_BIRDS = ("person", "child", "dog", "bird")
LONGEST_PAUSE_S = 60.0
"""So that a pad exists that is blocked for longer than a landing system can wait."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StoryValue:
    """One value of a story: what can be flown of it, and what a search draws of it.

    A draw outside of what can be flown is its nearest end.  A value with choices names one of them
    by its number, rounded down.  ``grades`` are those in which it counts, ``types`` the NPCs that
    have it.
    """

    quantity: Quantity
    draws: tuple[float, float]
    grades: tuple[str, ...] = GRADES[:3]
    types: tuple[str, ...] = WALKERS_AND_BIRDS

    @property
    def name(self) -> str:
        """The name in files, which ends with its unit."""
        return self.quantity.name

    @property
    def is_place(self) -> bool:
        """Whether it is a place: none is simpler than another."""
        return self.name.startswith("crosses_")

    def flown(self, value: float) -> float:
        """Return what is flown for a value of a chromosome."""
        value = min(self.quantity.high, max(self.quantity.low, value))
        return float(int(value)) if self.quantity.choices else value


def _value(
    name: str,
    *,
    low: float,
    high: float,
    draws: tuple[float, float],
    meaning: str,
    source: str,
    choices: tuple[str, ...] = (),
    grades: tuple[str, ...] = GRADES[:3],
    types: tuple[str, ...] = WALKERS_AND_BIRDS,
) -> StoryValue:
    quantity = Quantity(
        key=f"npcs.{name}",
        low=low,
        high=high,
        meaning=meaning,
        source=source,
        choices=choices,
        even=True,
    )
    return StoryValue(quantity=quantity, draws=draws, grades=grades, types=types)


def _chosen(name: str, choices: tuple[str, ...], *, last: int = 1, **others: Any) -> StoryValue:
    """Return a value with choices; the last one is drawn ``last`` times as often as another."""
    count = len(choices)
    draws = 0.0, count - 1 + last - 1e-6
    return _value(name, low=0.0, high=count - 1.0, draws=draws, choices=choices, **others)


STORY: Mapping[str, StoryValue] = {
    each.name: each
    for each in (
        _chosen(
            "grade",
            GRADES,
            meaning="how much it knows of the UAV, and what it wants",
            source="docs/adversary.md",
            grades=GRADES,
        ),
        _chosen(
            "body",
            ("adult", "child"),
            meaning="whether a person is a child",
            source="docs/adversary.md",
            grades=GRADES,
            types=("person",),
        ),
        _chosen(
            "phase",
            STORY_MOMENTS,
            last=len(STORY_MOMENTS),
            meaning="the moment for which it waits before it comes",
            source="what goes wrong depends on what the UAV does when an NPC comes",
        ),
        _value(
            "delay_s",
            low=0.0,
            high=120.0,
            draws=(0.0, 20.0),
            meaning="how long after its moment it comes",
            source="a descent from 10 m takes 10 to 20 s",
        ),
        _value(
            "lasts_s",
            low=0.0,
            high=CURIOUS_S,
            draws=(0.0, CURIOUS_S),
            meaning="how long it interferes; a chase lasts at most 5 s",
            source="engineering estimate",
            grades=("curious", "chasing"),
        ),
        *(
            _value(
                f"crosses_{axis}_m",
                low=-30.0,
                high=30.0,
                draws=(-3.0, 3.0),
                meaning=f"the point that it crosses, {axis} from the marker",
                source="around the marker, as far as a UAV of 1 m and a person reach",
                grades=("careless",),
            )
            for axis in ("x", "y")
        ),
        _value(
            "pause_s",
            low=0.0,
            high=LONGEST_PAUSE_S,
            # Half of all draws have no pause.
            draws=(-LONGEST_PAUSE_S, LONGEST_PAUSE_S),
            meaning="how long it stands where it crosses",
            source="engineering estimate: a telephone call",
            grades=("careless",),
            types=("person", "child", "dog"),
        ),
        _value(
            "stoop_m",
            low=0.0,
            high=14.0,
            draws=(-14.0, 14.0),
            meaning="how far a bird comes down, to 1 m above the ground at the lowest",
            source="gulls and birds of prey dive at food and at intruders",
            types=("bird",),
        ),
    )
}
"""The values of stories in the order of files, by name."""
LIMITS_S = {"careless": 0.0, "curious": CURIOUS_S, "chasing": CHASE_S, "hostile": float("inf")}
"""How long an NPC of each grade interferes at most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Story:
    """What one NPC does in a flight.

    It comes ``delay_s`` after its moment: ``phase`` is its number in :data:`STORY_MOMENTS`.  A
    careless one goes straight through ``crossing_m``, relative to the marker, stands there for
    ``pause_s``, goes on and leaves.  One that interferes does so for ``lasts_s`` and leaves.  A
    hostile one attacks during the whole flight.
    """

    grade: str
    phase: int = 0
    delay_s: float = 0.0
    lasts_s: float = 0.0
    crossing_m: tuple[float, float] = (0.0, 0.0)
    pause_s: float = 0.0
    stoop_m: float = 0.0
    is_child: bool = False

    def begins_s(self, moments_s: tuple[float, ...]) -> float:
        """Return when it comes, for the times of the moments so far; infinite if nobody knows."""
        return moments_s[self.phase] + self.delay_s


def when_in_words(moment: int, delay_s: float) -> str:
    """Return a time after one of :data:`STORY_MOMENTS`: ``2.0 s after the UAV passes 3 m``."""
    return (
        f"{delay_s:.1f} s after {_IN_WORDS[moment]}" if delay_s > 0 else f"when {_IN_WORDS[moment]}"
    )


def story_of(scenario: Scenario, name: str) -> Story | None:
    """Return the story of an NPC, None if the scenario has none for it."""
    if not has_story(scenario, name):
        return None
    found = {each: _flown(scenario, name, each) for each in STORY}
    grade = GRADES[int(found["grade"])]
    moment = int(found["phase"])
    is_decided = STORY_MOMENTS[moment] == DECIDED
    if is_decided and grade == GRADES[0]:
        # Who perceives nothing decides nothing, and comes just in time.
        moment = STORY_MOMENTS.index(MET)
    return Story(
        grade=grade,
        phase=moment,
        delay_s=0.0 if is_decided else found["delay_s"],
        lasts_s=min(found["lasts_s"], LIMITS_S[grade]),
        crossing_m=(found["crosses_x_m"], found["crosses_y_m"]),
        pause_s=found["pause_s"],
        stoop_m=found["stoop_m"],
        is_child=bool(found["body"]),
    )


def waits_for_decision(story: Story) -> bool:
    """Whether the director decides when an NPC comes."""
    return STORY_MOMENTS[story.phase] == DECIDED


def has_story(scenario: Scenario, name: str) -> bool:
    """Whether a scenario says what an NPC does, instead of leaving all to the NPC policy."""
    return any(key == f"{name}.grade" for key, _ in scenario.genes)


def story_values(scenario: Scenario, name: str, kind: str) -> dict[str, float]:
    """Return the values of a story that count for its grade and for the NPC's type.

    Nominal values are left out, except the grade.
    """
    if not has_story(scenario, name):
        return {}
    grade = GRADES[int(_flown(scenario, name, "grade"))]
    values = {}
    for key, each in STORY.items():
        value = _flown(scenario, name, key)
        if key == "lasts_s":
            value = min(value, LIMITS_S[grade])
        counts = grade in each.grades and kind in each.types
        if key == "grade" or (counts and value != each.quantity.nominal):
            values[key] = value
    return values


def with_all_values(values: Mapping[str, float], name: str, kind: str) -> dict[str, float]:
    """Return the genes of a story; values that are not given are nominal."""
    return {
        f"{name}.{key}": float(values.get(key, each.quantity.nominal))
        for key, each in STORY.items()
        if kind in each.types
    }


def children_in(scenario: Scenario, names: Iterable[str]) -> tuple[str, ...]:
    """Return the names of the persons who are children."""
    return tuple(name for name in names if _flown(scenario, name, "body"))


def _flown(scenario: Scenario, name: str, key: str) -> float:
    value = STORY[key]
    return value.flown(scenario.get(f"{name}.{key}", value.quantity.nominal))
