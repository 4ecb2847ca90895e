"""The weakest adversary for a collision: somebody who knows nothing and walks straight across.

The object that was hit comes alone, on a straight line through the place of the contact, at the
contact's time.  It starts as far away as there is room, so that it crosses at full speed.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pytest_garl.flight.flight import Flight, ObjectRecord
from pytest_garl.scenarios.bodies import Disc, discs_of
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import BIRD_HEIGHTS_M, OBJECT_TYPES, ObjectType
from pytest_garl.scenarios.placed import Placed, start_genes
from pytest_garl.scenarios.scenario import MARKER_PLACE, Scenario
from pytest_garl.scenarios.story import GRADES, STORY, with_all_values
from pytest_garl.scenarios.units import HEIGHT, PLACE_DIGITS
from pytest_garl.scenarios.validity import problems, repair
from pytest_garl.simulation.npc_policy import DECISION_STEP_S
from pytest_garl.simulation.physics.bird_path import ENTRY_M, LEAST_HEIGHT_M
from pytest_garl.simulation.physics.locomotion import STANDING_MPS, next_course

Plane = tuple[float, float]

USUAL_MPS = {"person": 1.4, "child": 2.0, "dog": 4.0}
"""A person's preferred walk (Diedrich and Warren 1995: below the transition to a run at 2 m/s), a
child beside such a walker, a dog's trot (`object_types.py`)."""
LEAST_MPS = 0.5
"""Nobody crosses a place more slowly than this; engineering estimate."""
NEAREST_M, FARTHEST_M = 2.0, 8.0
"""A walker starts this far from the place: out of the UAV's way, with room to reach its speed."""
SHIFTS_S = (-1.0, -2.0, 1.0, 2.0)
"""Shifts of the entry that measure the window: the inner ones before the outer ones."""
_TURNS_RAD = tuple(sign * turn * math.pi / 8 for turn in range(9) for sign in (1, -1))
"""Turns from the course at the contact, tried in this order until a way is free."""
BIRD_GAP_M = 0.5
"""A bird keeps a larger distance from what stands beside its way (`solids_ahead.py`)."""
THERE_M = 1.0
"""A UAV is at a place if it is no farther from it than this: its own length."""
_STEP_S = 1 / 60
"""The simulator moves objects at this interval."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Encounter:
    """Where and when the UAV was hit: the object's place, course and speed at the contact.

    ``uav_m`` is where the UAV was then.
    """

    name: str
    type: ObjectType
    kind: str
    time_s: float
    place_m: tuple[float, float, float]
    course_rad: float
    speed_mps: float
    uav_m: tuple[float, float, float]

    @property
    def usual_speed_mps(self) -> float:
        """The speed of a crossing: the speed at the contact, but at most a usual one."""
        if self.type.flies:
            return max(self.type.least_speed_mps, round(self.speed_mps, PLACE_DIGITS))
        usual = min(self.speed_mps, USUAL_MPS[self.type.name])
        return round(max(LEAST_MPS, usual), PLACE_DIGITS)


def encounter_of(flight: Flight, map: Map) -> Encounter | None:
    """Return the encounter with a moving object that ended a flight, or None."""
    contact = flight.contacts[-1] if flight.contacts else None
    kinds = dict(map.all_objects)
    if contact is None or contact.body_class != "dynamic" or contact.body not in kinds:
        return None
    hit = next((item for item in flight.objects if item.name == contact.body), None)
    if hit is None or hit.type not in OBJECT_TYPES or not len(hit.track.time_s):
        return None
    index = hit.track.index_at(contact.time_s)
    x, y, z = (float(value) for value in hit.track.position_m[index])
    vx, vy = (float(value) for value in hit.track.velocity_mps[index, :2])
    ux, uy, uz = (float(value) for value in flight.uav.position_m[index])
    return Encounter(
        name=contact.body,
        type=OBJECT_TYPES[hit.type],
        kind=kinds[contact.body],
        time_s=contact.time_s,
        place_m=(x, y, z),
        course_rad=_course_rad(hit, (x, y), (vx, vy)),
        speed_mps=math.hypot(vx, vy),
        uav_m=(ux, uy, uz),
    )


def retimed_encounter(encounter: Encounter, missed: Flight) -> Encounter | None:
    """Return an encounter at another time: when the UAV was there in a flight that missed it.

    Returns None if the UAV was never there, or was there at about the encounter's time.
    """
    away_m = np.linalg.norm(missed.uav.position_m - np.array(encounter.uav_m), axis=1)
    if not len(away_m) or away_m.min() > THERE_M:
        return None
    time_s = float(missed.uav.time_s[int(away_m.argmin())])
    if abs(time_s - encounter.time_s) < DECISION_STEP_S:
        return None
    return dataclasses.replace(encounter, time_s=time_s)


def _course_rad(hit: ObjectRecord, place_m: Plane, velocity_mps: Plane) -> float:
    """Return the course at the contact; for an object that stood, the direction from its start."""
    if math.hypot(*velocity_mps) > STANDING_MPS:
        return math.atan2(velocity_mps[1], velocity_mps[0])
    x, y = (float(value) for value in hit.track.position_m[0, :2])
    return math.atan2(place_m[1] - y, place_m[0] - x)


def straight_crossing(bare: Scenario, encounter: Encounter, map: Map) -> Scenario | None:
    """Return a scenario in which the object of an encounter crosses its place and is careless.

    ``bare`` is a scenario with no other object.  Returns None if no way there is free.
    """
    for turn_rad in _TURNS_RAD:
        course = encounter.course_rad + turn_rad
        for start, delay_s in _starts(encounter, course, map):
            scenario = _with_story(bare, encounter, start, delay_s, map)
            if not problems(scenario, map) and _is_free(encounter, start, map):
                # An object that the repair moves would not be there in time.
                repaired = repair(scenario, map)
                if not _has_moved(scenario, repaired):
                    return repaired
    return None


def shifted(scenario: Scenario, name: str, by_s: float, map: Map) -> Scenario | None:
    """Return the scenario with an entry shifted by a time; None if that is out of range."""
    delay_s = scenario[f"{name}.delay_s"] + by_s
    if not 0 <= delay_s <= STORY["delay_s"].quantity.high:
        return None
    return repair(scenario.replace({f"{name}.delay_s": delay_s}), map)


def _starts(encounter: Encounter, course_rad: float, map: Map) -> Iterator[tuple[Plane, float]]:
    """Yield places to start from with the delay that fits, from far to near."""
    x, y, _ = encounter.place_m
    speed = encounter.usual_speed_mps
    if encounter.type.flies:
        # A bird enters at full speed, at least ENTRY_M away, wherever on the course it starts.
        delay_s = encounter.time_s - ENTRY_M / speed
        for away_m in range(round(FARTHEST_M), 0, -1) if delay_s >= 0 else ():
            yield (x - away_m * math.cos(course_rad), y - away_m * math.sin(course_rad)), delay_s
        return
    early: list[tuple[Plane, float]] = []
    steps = int(encounter.time_s / DECISION_STEP_S)
    for delay_s in (DECISION_STEP_S * step for step in range(steps + 1)):
        if (encounter.time_s - delay_s) * speed > FARTHEST_M + speed:
            continue
        dx, dy = walked_m(encounter.type, speed, course_rad, encounter.time_s - delay_s)
        if NEAREST_M <= math.hypot(dx, dy) <= FARTHEST_M:
            early.append(((x - dx, y - dy), delay_s))
    # First the entries that can be shifted both ways.
    late = [each for each in early if each[1] >= max(SHIFTS_S)]
    yield from late
    yield from reversed([each for each in early if each not in late])


def walked_m(kind: ObjectType, speed_mps: float, course_rad: float, time_s: float) -> Plane:
    """Return how far an object walks on a course, if at first it stands and faces east."""
    wanted = speed_mps * math.cos(course_rad), speed_mps * math.sin(course_rad)
    x = y = vx = vy = yaw = 0.0
    for _ in range(round(time_s / _STEP_S)):
        yaw, speed = next_course(kind, (vx, vy), yaw, wanted, _STEP_S, flies=False)
        vx, vy = speed * math.cos(yaw), speed * math.sin(yaw)
        x, y = x + vx * _STEP_S, y + vy * _STEP_S
    return x, y


def _with_story(
    bare: Scenario, encounter: Encounter, start: Plane, delay_s: float, map: Map
) -> Scenario:
    name, kind = encounter.name, encounter.type
    x, y, z = encounter.place_m
    placed = Placed(bare, map)
    mx, my = placed.marker_m
    story = {
        "grade": float(GRADES.index("careless")),
        "body": float(kind.name == "child"),
        "delay_s": round(delay_s, PLACE_DIGITS),
        "crosses_x_m": round(x - mx, PLACE_DIGITS),
        "crosses_y_m": round(y - my, PLACE_DIGITS),
    }
    values = {f"{name}.velocity": kind.share_of(encounter.usual_speed_mps)}
    if kind.flies:
        # The bird's own height may be below the end of a stoop.
        height_m = round(
            min(BIRD_HEIGHTS_M[1], max(BIRD_HEIGHTS_M[0], LEAST_HEIGHT_M, z)), PLACE_DIGITS
        )
        if height_m != placed.npc(name).height_m or bare.get(f"{name}.{HEIGHT}", 0.0):
            values[f"{name}.{HEIGHT}"] = height_m
    values |= start_genes(name, start, map)
    values |= with_all_values(story, name, encounter.kind)
    kept = tuple(pair for pair in bare.genes if pair[0].partition(".")[0] != name)
    return dataclasses.replace(bare, genes=(*kept, *values.items()))


def _is_free(encounter: Encounter, start: Plane, map: Map) -> bool:
    """Return whether nothing solid stands in the way, up to the place of the contact."""
    kind, (x, y, z) = encounter.type, encounter.place_m
    low_m, gap_m, end = z + kind.low_m, kind.radius_m, (x, y)
    if kind.flies:
        # A bird enters far behind its start, and turns away from what stands ahead of it.
        away_m = max(1e-9, math.dist(start, end))
        back_x, back_y = (start[0] - x) / away_m, (start[1] - y) / away_m
        ahead_m = 2 * kind.turn_radius_m
        start, end = (
            (x + ENTRY_M * back_x, y + ENTRY_M * back_y),
            (
                x - ahead_m * back_x,
                y - ahead_m * back_y,
            ),
        )
        gap_m += BIRD_GAP_M
    discs = (
        disc
        for body in map.bodies
        for disc in discs_of(body)
        if disc.low_m < low_m + kind.height_m and low_m < disc.high_m
    )
    return all(_distance_m(start, end, disc) >= disc.radius_m + gap_m for disc in discs)


def _distance_m(start: Plane, end: Plane, disc: Disc) -> float:
    """Return the distance of a disc's middle from the way between two places."""
    ahead_x, ahead_y = end[0] - start[0], end[1] - start[1]
    length = math.hypot(ahead_x, ahead_y)
    along = (disc.x_m - start[0]) * ahead_x + (disc.y_m - start[1]) * ahead_y
    share = min(1.0, max(0.0, along / length**2)) if length > 0 else 0.0
    return math.dist((start[0] + share * ahead_x, start[1] + share * ahead_y), (disc.x_m, disc.y_m))


def _has_moved(scenario: Scenario, repaired: Scenario) -> bool:
    """Return whether the repair moved a place by more than the rounding of files."""
    before, after = dict(scenario.genes), dict(repaired.genes)
    ends = (*MARKER_PLACE, "start_x", "start_y")
    return any(abs(before[key] - after[key]) > 1e-3 for key in before if key.endswith(ends))
