"""The margin of the arm `rule`: the best one on a development seed, by geometry.

In the scenarios of judge 3 the NPC waits to the end, and the recorded flight tells for each begin
whether they would meet, and whether the UAV would see the NPC in time
(:mod:`pytest_garl.npcs.lessons`).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from lab.judges.flights import MAPS, SYSTEMS
from lab.judges.preventable import scenario_of
from lab.one_search import flown_by
from pytest_garl.execution.reference import system_named
from pytest_garl.landing_system import airframe_of
from pytest_garl.npcs.directed import TIME_TO_GO
from pytest_garl.npcs.director import Director, TimeToGo
from pytest_garl.npcs.domain_policy import GRADED
from pytest_garl.npcs.learned import learned_director
from pytest_garl.npcs.lessons import IN_VIEW, SINKS_MPS, Lesson, Response, lessons_of, sinking_mps
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.maps.loading import load_map

SEED, SCENARIOS = 200, 10
NEVER = 1000
MARGINS_S = np.arange(-1.0, 3.1, 0.5)


def lessons(scenarios: int = SCENARIOS) -> Iterator[tuple[str, Lesson]]:
    """Fly scenarios in which the NPC waits; yield system and lesson."""
    npcs = policy_spec(GRADED).directed_by(f"{TIME_TO_GO} -{NEVER} {NEVER}")
    for number, map_name, name in itertools.product(range(scenarios), MAPS, SYSTEMS):
        system, map = system_named(SYSTEMS[name]), load_map(map_name)
        scenario = scenario_of(map_name, SEED, number, as_gene=False)
        flight = flown_by(system, npcs, scenario).record
        assert flight is not None
        sinks_mps = sinking_mps(flight) or SINKS_MPS
        for lesson in lessons_of(flight, scenario, map, airframe_of(system), sinks_mps):
            yield name, lesson


def share(director: Director, taught: Sequence[Lesson]) -> float:
    """Return the share of NPCs that are expected to meet the UAV in its view, and in time."""
    response, total = Response(), 0.0
    for lesson in taught:
        goes = (number for number, row in enumerate(lesson.states) if director.decides(row))
        number = next(goes, None)
        if number is not None:
            shares = [response.share(e) * (e.kind == IN_VIEW) for e in lesson.forecasts]
            total += float(np.interp(number, lesson.asked, shares, left=0.0, right=0.0))
    return total / len(taught)


def report(taught: Sequence[tuple[str, Lesson]]) -> str:
    """Return a table in Markdown: a row for each system, and one for all."""
    margins = MARGINS_S.tolist()
    heads = " | ".join(f"{each:g} s" for each in margins)
    lines = [
        f"| system | flights | {heads} | the director that ships |",
        f"| --- | ---: |{' ---: |' * (len(margins) + 1)}",
    ]
    for name in (*SYSTEMS, "all"):
        own = [lesson for system, lesson in taught if name in (system, "all")]
        deciders: list[Director] = [TimeToGo(margin_s=each) for each in margins]
        deciders.append(learned_director())
        cells = (f"{100 * share(each, own):.0f} %" for each in deciders)
        lines.append(f"| {name} | {len(own)} | {' | '.join(cells)} |")
    return "\n".join(lines)
