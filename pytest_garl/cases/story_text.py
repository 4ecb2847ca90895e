"""What an NPC with a story does, in plain physical words, for a reader of a case."""

from __future__ import annotations

import math

from pytest_garl.npcs.grades import GRADE_LIMITS
from pytest_garl.scenarios.placed import Place, Placed, PlacedNpc
from pytest_garl.scenarios.story import GRADES, LIMITS_S, Story, when_in_words
from pytest_garl.simulation.physics.bird_path import LEAST_HEIGHT_M
from pytest_garl.verdicts.wording import compass_point

MIDDLE_M = 0.05
"""A crossing that is nearer to the marker's middle is said to be there; texts show decimetres."""


def grade_in_words(grade: str) -> str:
    """Return what an NPC of a grade knows and wants; empty for no grade."""
    if grade == "careless":
        return "it knows nothing of the UAV"
    if grade == "hostile":
        return "it knows everything at once, and attacks"
    limits = GRADE_LIMITS.get(grade)
    if limits is None:
        return ""
    return (
        f"it sees the UAV within {limits.sees_within_m:g} m, {limits.delay_s:g} s late; "
        f"{limits.intention}"
    )


def story_in_words(placed: Placed, name: str, policy: str = "graded") -> str:
    """Return what an NPC does, ``a careless person: sets off from ...``.

    ``policy`` names the NPC policy that moves it.  Returns nothing for an NPC without a story, and
    for one whose policy follows none.
    """
    npc = placed.npc(name)
    story = npc.story
    if story is None or (policy != "graded" and policy not in GRADES):
        return ""
    grade = story.grade if policy == "graded" else policy
    kind, speed_mps = npc.type, npc.speed_mps
    told = [f"a {grade} {kind.name}: {_comes(placed.marker_m, npc, story, grade)}"]
    if grade == "careless":
        told.append(f"crosses {_place(story.crossing_m)} at {speed_mps:.1f} m/s")
        if story.pause_s > 0 and not kind.flies:
            told.append(f"stands there for {story.pause_s:.1f} s")
    else:
        verb = "flies" if kind.flies else "moves"
        told.append(f"{verb} at up to {speed_mps:.1f} m/s")
        told.append(_interferes(min(story.lasts_s, LIMITS_S[grade]), grade))
    if kind.flies:
        height_m = npc.height_m
        told[1] += f", {height_m:.1f} m up"
        lowest_m = max(min(height_m, LEAST_HEIGHT_M), height_m - story.stoop_m)
        if story.stoop_m > 0 and grade != "hostile":
            told[1] += f" and down to {lowest_m:.1f} m"
    return ", ".join(told)


def _comes(marker_m: Place, npc: PlacedNpc, story: Story, grade: str) -> str:
    """Return from where and when it comes; a bird comes from afar."""
    x, y = npc.start_m
    origin = f"({x:.1f}, {y:.1f}) m"
    if grade == "hostile":
        return f"is there from the start, at {origin}"
    when = when_in_words(story.phase, story.delay_s)
    if not npc.type.flies:
        return f"sets off from {origin} {when}"
    mx, my = marker_m
    dx, dy = story.crossing_m
    return f"comes from the {compass_point(x - mx - dx, y - my - dy)} {when}"


def _place(crossing_m: tuple[float, float]) -> str:
    away_m = math.hypot(*crossing_m)
    if away_m < MIDDLE_M:
        return "the middle of the marker"
    return f"{away_m:.1f} m {compass_point(*crossing_m)} of the marker"


def _interferes(lasts_s: float, grade: str) -> str:
    if grade == "hostile":
        return "attacks during the whole flight"
    verb = "pursues the UAV" if grade == "chasing" else "interferes"
    return f"{verb} for at most {lasts_s:.1f} s" if lasts_s > 0 else "leaves once it sees the UAV"
