"""Tables of counterfactual moments: how a landing ends for each moment at which its NPC begins.

An NPC that waits stands still, and a landing does not depend on it.  So one landing in which it
waits to the end gives what it knows at each decision.  What begin at a moment is worth follows by
geometry if the UAV flies straight, or the NPC does not come near; else it is flown.  A table holds
the whole decision problem of a landing: each rule, learned or not, is judged on it without another
flight.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_garl.flight.flight import Flight
from pytest_garl.npcs.decision_rules import Intercepting
from pytest_garl.npcs.director import FEATURES, Watch
from pytest_garl.npcs.encounter import (
    AFTERMATH_STEPS,
    COLLISION_WORTH,
    PREVENTABLE_WORTH,
    WITHIN_S,
    Passage,
    could_be_prevented,
    first_seen_s,
    in_picture,
)
from pytest_garl.npcs.interference import Interference, Interfering
from pytest_garl.npcs.training.graded_landing import GradedLanding, draw_graded_landing
from pytest_garl.npcs.training.presets import Surrogate
from pytest_garl.npcs.training.uav_models import MOST_CAUTIOUS_M
from pytest_garl.scenarios.groups import DESCENT
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.story import STORY
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, Situation

NEVER_S = STORY["delay_s"].quantity.high
"""An NPC that begins then never does in a landing of the surrogate."""
EARLY_S = 1 / 120
"""The situation before a decision is a tick old, so a moment is set earlier by this."""
STRIDE = 2
"""Moments are a second apart, every second decision."""
Meeting = tuple[float | None, float | None, float]
"""When the NPC and the UAV touch, when the UAV saw it first, when the UAV touched down."""
HARMLESS, GROUNDED, COLLIDED, PREVENTABLE = range(4)
"""How a landing ends for its NPC: without a contact, with one of a UAV that had touched down, which
counts for nobody, with a collision in the air, and with one that could have been prevented."""
WORTH: Mapping[int, float] = {COLLIDED: COLLISION_WORTH, PREVENTABLE: PREVENTABLE_WORTH}
"""What an end is worth; others nothing."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MomentTable:
    """One landing: what the NPC knows at each decision, and what begin at some of them leads to.

    ``features`` (n, features) are those of the decisions 0, 0.5 s, …  ``meetings`` (m, 3) are for
    begins at every :data:`STRIDE`-th of them the times of the contact with the NPC, of its first
    sight before and of the touchdown, NaN where there is none, and ``never`` (3,) those of an NPC
    that never begins.  ``descent_s`` are when the moments of the descent came without it; ``flown``
    is how many moments were flown.
    """

    seed: int
    kind: str
    grade: str
    uav: str
    features: NDArray[np.float64]
    meetings: NDArray[np.float64]
    never: NDArray[np.float64]
    descent_s: tuple[float, ...]
    flown: int

    @property
    def ends(self) -> NDArray[np.int64]:
        """How the landing ends, for each moment, (m,)."""
        return np.array([_end(*row) for row in self.meetings.tolist()], dtype=np.int64)

    def end_of(self, number: int | None) -> int:
        """Return how it ends if the NPC begins at a decision, or the known one before; or never."""
        return _end(*(self.never if number is None else self.meetings[number // STRIDE]).tolist())


def table_of(seed: int, landing: GradedLanding) -> MomentTable:
    """Return the table of a landing."""
    rows: list[NDArray[np.float64]] = []
    watch: list[Watch] = []

    def note(situation: Situation) -> None:
        if not watch:
            watch.append(Watch(situation))
        rows.append(watch[0].look(situation))

    waiting, descent_s = _fly(landing.with_begin_at(NEVER_S), note)
    stopped = [each.time_s for each in waiting.events if each.name == "motors_stopped"]
    free = landing.uav == "straight" or not _is_near(waiting)
    meetings, flown = [], 0
    with Passage(
        waiting.uav,
        landing.scenario,
        landing.map,
        landing.npc,
        landing.airframe,
        lambda: Interfering(landing.grade, Intercepting()),
    ) as passage:
        for number in range(0, len(rows), STRIDE):
            moment_s = number * DECISION_STEP_S
            found = passage.begin_at(moment_s)
            if free and (landing.uav == "straight" or found.nearest_m > _reach_m(waiting)):
                met_s = found.contact_s
                if met_s is not None and stopped and met_s > stopped[0]:
                    met_s = None
                meetings.append((met_s, found.seen_s, descent_s[-1]))
            else:
                meetings.append(_flown(landing, moment_s - EARLY_S))
                flown += 1
    return MomentTable(
        seed=seed,
        kind=landing.map.present_objects[0][1],
        grade=landing.grade,
        uav=landing.uav,
        features=np.array(rows).reshape(-1, len(FEATURES)),
        meetings=np.array(meetings, dtype=np.float64).reshape(-1, 3),
        never=np.array(_meeting(waiting, descent_s, landing), dtype=np.float64),
        descent_s=descent_s,
        flown=flown,
    )


def drawn_table(surrogate: Surrogate, seed: int, folder: Path) -> MomentTable:
    """Return the table of the landing that a seed draws; a folder keeps it."""
    file = folder / f"{seed}.npz"
    if file.exists():
        with np.load(file) as kept:
            text = {key: str(kept[key]) for key in ("kind", "grade", "uav")}
            return MomentTable(
                seed=seed,
                features=kept["features"],
                meetings=kept["meetings"],
                never=kept["never"],
                descent_s=tuple(kept["descent_s"].tolist()),
                flown=int(kept["flown"]),
                **text,
            )
    landing = draw_graded_landing(surrogate, np.random.default_rng(seed))
    table = table_of(seed, landing)
    folder.mkdir(parents=True, exist_ok=True)
    half = folder / f"{seed}.part.npz"
    arrays: dict[str, Any] = {
        key: np.array(value) for key, value in dataclasses.asdict(table).items()
    }
    np.savez(half, **arrays)
    half.replace(file)
    return table


def _end(contact_s: float, seen_s: float, touchdown_s: float) -> int:
    if math.isnan(contact_s):
        return HARMLESS
    if contact_s >= touchdown_s:
        return GROUNDED
    seen = None if math.isnan(seen_s) else seen_s
    return PREVENTABLE if could_be_prevented(contact_s, seen) else COLLIDED


def _flown(landing: GradedLanding, moment_s: float) -> Meeting:
    return _meeting(*_fly(landing.with_begin_at(moment_s)), landing)


def _meeting(flight: Flight, descent_s: tuple[float, ...], landing: GradedLanding) -> Meeting:
    if flight.outcome != "collision" or flight.contacts[-1].body != landing.npc:
        return None, None, descent_s[-1]
    contact_s, item = flight.contacts[-1].time_s, flight.objects[0]
    camera = landing.airframe.camera
    shown = in_picture(flight.uav, item.track.position_m, OBJECT_TYPES[item.type], camera)
    return contact_s, first_seen_s(flight.uav, shown, contact_s - WITHIN_S), descent_s[-1]


def _fly(
    landing: GradedLanding, on_decision: Callable[[Situation], None] = lambda situation: None
) -> tuple[Flight, tuple[float, ...]]:
    """Fly a landing; show each decision's situation; return the record and when phases began."""
    episode, rule, left = landing.begin(), Intercepting(), AFTERMATH_STEPS
    try:
        situation = episode.situations[0]
        # The story says everything: nothing is drawn.
        part = Interference(landing.grade, situation, np.random.default_rng(0))
        while episode.outcome is None:
            on_decision(situation)
            belief = part.look(situation)
            if belief is not None:
                part.answer(rule.decide(belief))
            left -= part.is_over
            if left < 0:
                break
            episode.step([part.move(situation)])
            situation = episode.situations[0]
        return episode.record, situation.moments_s[: len(DESCENT)]
    finally:
        episode.close()


def _reach_m(flight: Flight) -> float:
    """Return how near the NPC must come for the most cautious UAV to take notice."""
    return MOST_CAUTIOUS_M + OBJECT_TYPES[flight.objects[0].type].radius_m


def _is_near(flight: Flight) -> bool:
    """Whether the UAV may have taken notice of the NPC that waits."""
    way = flight.objects[0].track.position_m[:, :2] - flight.uav.position_m[:, :2]
    return bool((np.hypot(*way.T) <= _reach_m(flight)).any())
