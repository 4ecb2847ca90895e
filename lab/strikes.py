"""When events strike: what learned decisions are worth, beside random moments and a fixed rule.

``python -m lab.strikes`` takes copies of the stand-in of a landing (``lab/stand_in.py``), all of
whose constants are off by up to 30 %, as landing systems that nobody knows.  In each the director
of events learns from flights, generation by generation, as in a search: half of the events strike
as it decides, half at moments of their genes.  Then other scenarios are landed, in which events
strike at a moment of their genes, at the start, by the fixed rule at 3 m, and as the director
decides; and all at once at each second of the landing, which tells how often somebody could have
hit who knows the end.  A row per landing system and decider goes to ``docs/strikes.csv``;
``--report`` prints the table.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lab.arms import DOMAIN, without_decisions
from lab.stand_in_model import perturbed_copy
from lab.table import ResultTable, Row, run_study
from pytest_garl import cpu_dispatch
from pytest_garl.execution.result import FlightResult
from pytest_garl.npcs.event_lessons import EventLesson, OwnEventDirector
from pytest_garl.npcs.event_watch import EventWatch, LearnedStrikes
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.groups import EVENTS, MOMENTS, QUANTITIES
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.columns import NOBODY, Columns
from pytest_garl.search.exploration import Exploration
from pytest_garl.search.teaching import outcome_of
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, EventDirector, Outlook
from pytest_garl.simulation.strikes import AtThreeMetres

MAP = "court"
SEED = 5200
"""Of the scenarios, the same for all landing systems."""
OFF_BY = 0.3
GENERATIONS, SIZE = 5, 20
"""Of the flights from which a director learns, as in the first quarter of 400 flights."""
TABLE = ResultTable(
    file=Path("docs/strikes.csv"),
    columns=("landing", "decider", "landings", "violating", "expected", "violated"),
    key=("landing", "decider"),
)
GENE, START, RULE, LEARNED, BEST = (
    "a moment of its genes",
    "at the start",
    "the fixed rule, at 3 m",
    "the director that learned",
    "whoever knows the end",
)


def acting(scenario: Scenario) -> Sequence[str]:
    """Return the events that act in a scenario."""
    named = {key.partition(".")[0] for key, _ in scenario.genes}
    return [event for event in EVENTS if event in named]


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Landing:
    """One landing of a copy of the stand-in: what a director is shown, and how it ends."""

    copy: Any
    map: Map
    scenario: Scenario

    @property
    def events(self) -> Sequence[str]:
        """The events that act."""
        return acting(self.scenario)

    @property
    def outlooks(self) -> Sequence[Outlook]:
        """What a director is shown at each decision; no event changes the way of a stand-in."""
        way = self.copy.way_of(self.scenario, self.map, np.random.default_rng(self.scenario.seed))
        moments, found = way.moments_s, []
        readable_s, lost_s = (moments[MOMENTS.index(name)] for name in ("readable", "lost"))
        for now in np.arange(0.0, way.lands_s, DECISION_STEP_S).tolist():
            (x, y, z), before = way.at(now), way.at(max(0.0, now - DECISION_STEP_S))
            vx, vy, vz = ((a - b) / DECISION_STEP_S for a, b in zip((x, y, z), before, strict=True))
            found.append(
                Outlook(
                    time_s=now,
                    uav_position_m=(x, y, z),
                    uav_velocity_mps=(vx, vy, vz),
                    marker_position_m=way.marker_m,
                    moments_s=tuple(each if each <= now else np.inf for each in moments),
                    is_readable=readable_s <= now < lost_s,
                )
            )
        return found

    def decided_by(self, director: EventDirector) -> Mapping[str, float]:
        """Return when the director lets the events strike."""
        struck: dict[str, float] = {}
        for outlook in self.outlooks:
            waiting = [event for event in self.events if event not in struck]
            for event in director.strikes(outlook, waiting):
                struck[event] = outlook.time_s
        return struck

    def at_genes(self) -> Mapping[str, float]:
        """Return when the events strike by their genes."""
        way = self.copy.way_of(self.scenario, self.map, np.random.default_rng(self.scenario.seed))
        found = {}
        for event in self.events:
            key = f"{event}.after"
            moment = int(QUANTITIES[key].flown(self.scenario[key]))
            found[event] = way.moments_s[moment] + self.scenario[f"{event}.from_s"]
        return found

    def result(self, struck: Mapping[str, float]) -> FlightResult:
        """Return how it ends if events strike at these times, others never."""
        latest_s = QUANTITIES["cover.from_s"].high
        genes: dict[str, float] = {}
        for event in self.events:
            genes[f"{event}.after"] = 0.0
            genes[f"{event}.from_s"] = struck.get(event, latest_s)
        found: FlightResult = self.copy.stand_in(self.scenario.replace(genes), self.map)
        return found

    def lesson(self, struck: Mapping[str, float]) -> EventLesson:
        """Return what it teaches if events strike at these times."""
        watch = EventWatch()
        rows = np.array([watch.look(outlook) for outlook in self.outlooks])
        numbers = {event: int(time_s / DECISION_STEP_S) for event, time_s in struck.items()}
        return EventLesson(
            rows=rows,
            struck={event: each for event, each in numbers.items() if each < len(rows)},
            outcome=outcome_of(self.result(struck)),
        )


def scenarios(map: Map) -> Iterator[Scenario]:
    """Yield scenarios without NPCs in which events act, as a search draws them."""
    genome = without_decisions(genome_of(DOMAIN, map))
    rng, exploration = np.random.default_rng(SEED), Exploration(Columns(genome), map)
    exploration.flight_s = 30.0
    while True:
        row = exploration.new(NOBODY, rng)
        scenario = repair(decode(row, genome, map=map.name, seed=int(rng.integers(2**32))), map)
        if acting(scenario):
            yield scenario


def rows_of(number: int, map: Map, drawn: Sequence[Scenario]) -> Iterator[Row]:
    """Yield a row for each decider, of one landing system that learns from the first scenarios."""
    copy, director = perturbed_copy(OFF_BY, number), OwnEventDirector()
    all_landings = [Landing(copy=copy, map=map, scenario=scenario) for scenario in drawn]
    expected, violated = 0.0, 0
    for first in range(0, GENERATIONS * SIZE, SIZE):
        lessons = []
        for place, landing in enumerate(all_landings[first : first + SIZE]):
            learned = LearnedStrikes(director.network)
            struck = landing.at_genes() if place % 2 else landing.decided_by(learned)
            lessons.append(landing.lesson(struck))
        progress = director.learn_lessons(lessons)
        expected, violated = expected + progress.expected, violated + progress.violated
    test = all_landings[GENERATIONS * SIZE :]
    deciders: Mapping[str, Callable[[Landing], Mapping[str, float]]] = {
        GENE: Landing.at_genes,
        START: lambda landing: dict.fromkeys(landing.events, 0.0),
        RULE: lambda landing: landing.decided_by(AtThreeMetres()),
        LEARNED: lambda landing: landing.decided_by(LearnedStrikes(director.network)),
    }
    fails = {
        name: [landing.result(decides(landing)).verdict.violation for landing in test]
        for name, decides in deciders.items()
    }
    any_moment = [
        any(
            landing.result(dict.fromkeys(landing.events, each.time_s)).verdict.violation
            for each in landing.outlooks[::2]
        )
        for landing in test
    ]
    # Two events may need two moments, which only the deciders tried.
    fails[BEST] = [any(each) for each in zip(any_moment, *fails.values(), strict=True)]
    for name, each in fails.items():
        yield {
            "landing": str(number),
            "decider": name,
            "landings": str(len(test)),
            "violating": str(sum(each)),
            "expected": f"{expected:.2f}" if name == LEARNED else "",
            "violated": str(violated) if name == LEARNED else "",
        }


def report(rows: list[Row]) -> str:
    """Return the table, of all landing systems together.

    These land in the same scenarios, so that no interval is drawn.
    """
    lines = ["| who says when | landings | violations |", "| --- | ---: | ---: |"]
    for name in dict.fromkeys(row["decider"] for row in rows):
        own = [row for row in rows if row["decider"] == name]
        count, total = (sum(int(row[key]) for row in own) for key in ("violating", "landings"))
        lines.append(f"| {name} | {total} | {count} ({100 * count / total:.0f} %) |")
    own = [row for row in rows if row["decider"] == LEARNED]
    expected, violated = (
        sum(float(r["expected"]) for r in own),
        sum(int(r["violated"]) for r in own),
    )
    lines += [
        "",
        f"Of the strikes from which it learned it expected {expected:.1f} to end with a violation; "
        f"{violated} did.",
    ]
    return "\n".join(lines)


def fly(arguments: argparse.Namespace) -> None:
    """Land with all landing systems, and write the table anew."""
    cpu_dispatch.pin()
    map = load_map(MAP)
    drawn = list(itertools.islice(scenarios(map), GENERATIONS * SIZE + arguments.tested))
    TABLE.file.unlink(missing_ok=True)
    for number in range(arguments.landings):
        TABLE.append(rows_of(number, map, drawn))


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--landings", type=int, default=8, help="landing systems")
    parser.add_argument("--tested", type=int, default=25, help="scenarios for each")
    run_study(parser, TABLE, report, fly)


if __name__ == "__main__":
    main()
