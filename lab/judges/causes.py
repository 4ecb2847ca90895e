"""Judge 2: how many distinct confirmed causes of violations a search finds in a landing system."""

from __future__ import annotations

import dataclasses
import functools
import json
import os
import re
import subprocess
import sys
import tempfile
import weakref
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lab.arms import BEFORE_MOMENTS, FROZEN, arm_named
from lab.judges.flights import MAPS, SYSTEMS, Flights, flights_for, fly_each, named
from lab.judges.intervals import mean_of, over_pairs, p_of_signs
from lab.judges.tasks import FOLDER, Task
from lab.one_search import flights_of, plan_of
from lab.table import ResultTable, Row
from pytest_garl.errors import GarlError
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.flight.flight_file import load
from pytest_garl.scenarios.conditions import active_conditions, unread_groups, without_groups
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import children_in
from pytest_garl.shrinking.case_flights import find_colliding_object
from pytest_garl.shrinking.shrink import shrink

FLIGHTS = 400
SEEDS = tuple(range(23, 28))
FROZEN_SEEDS = SEEDS[:2]
ARMS = ("exploring+", "garl", "shuffled", FROZEN)
OURS = "garl"
SHRINK_FLIGHTS = 12
MOST_ASKED = 3
LEAST_TWINS = 2
TABLE = ResultTable(
    file=Path("docs/results/judge-causes.csv"),
    columns=(
        *("arm", "system", "seed", "map", "flights", "control", "violations", "signatures"),
        *("causes", "count", "asked", "unconfirmed", "beside", "commit"),
    ),
    key=("arm", "system", "seed"),
)
_NUMBER = re.compile(r"-\d+$")
Cause = frozenset[str]
Counts = dict[str, dict[tuple[str, str], int]]  # of each arm, by seed and system


def cause_in(scenario: Scenario) -> Cause:
    """Return the condition groups and the types of NPCs in a scenario, by name."""
    names = [key.partition(".")[0] for key, _ in scenario.genes if key.endswith(".velocity")]
    children = children_in(scenario, names)
    npcs = {"child" if name in children else _NUMBER.sub("", name) for name in names}
    return frozenset({_NUMBER.sub("", each.cause) for each in active_conditions(scenario)} | npcs)


@dataclass(frozen=True, slots=True, kw_only=True)
class Violating:
    """A violation of a search: its scenario, in which nothing is left to decide, and its flight."""

    number: int
    how: str
    scenario: Scenario
    flight: CompletedFlight


@dataclass(frozen=True, slots=True, kw_only=True)
class ConfirmedCause:
    """A cause, and the flight that showed it: ``twins`` of four violated alike."""

    cause: Cause
    kind: str
    signature: str
    number: int
    how: str
    twins: int

    def to_json(self) -> dict[str, Any]:
        """Return plain values."""
        return {**dataclasses.asdict(self), "cause": sorted(self.cause)}


@dataclass(slots=True, kw_only=True)
class Inventory:
    """The causes of a landing system's violations, as they are found out."""

    fly: Flights
    found: list[ConfirmedCause] = field(default_factory=list)
    asked: Counter[str] = field(default_factory=Counter)
    unconfirmed: int = 0
    beside: int = 0

    @property
    def causes(self) -> set[Cause]:
        """The distinct causes."""
        return {each.cause for each in self.found}

    def add(self, violating: Violating) -> None:
        """Find out the cause of a violation, unless a known one explains it."""
        result, acting = violating.flight.result, cause_in(violating.scenario)
        kind = result.verdict.cause
        if any(each.kind == kind and each.cause <= acting for each in self.found):
            return
        if self.asked[result.signature] >= MOST_ASKED:
            return
        self.asked[result.signature] += 1
        scenario = self._shrunk(violating)
        twins = sum(
            twin.verdict.violation and twin.verdict.cause == kind
            for twin in self.fly.twins(scenario)
        )
        self.beside += 4
        if twins < LEAST_TWINS:
            self.unconfirmed += 1
            return
        self.found.append(
            ConfirmedCause(
                cause=cause_in(scenario),
                kind=kind,
                signature=result.signature,
                number=violating.number,
                how=violating.how,
                twins=twins,
            )
        )

    def _shrunk(self, violating: Violating) -> Scenario:
        """Return the simplest scenario that violates the same property by the same kind of body."""
        first, result = violating.scenario, violating.flight.result
        if violating.flight.record.exists():
            # What the landing system never read is no cause.
            read = load(violating.flight.record).data_read
            first = without_groups(first, unread_groups(first, read))

        def fails(scenario: Scenario) -> bool:
            self.beside += 1
            verdict = self.fly(self.fly.job, scenario).result.verdict
            return verdict.violation and verdict.cause == result.verdict.cause

        hit = find_colliding_object(violating.flight)
        map = self.fly.job.load_map()
        return shrink(first, fails, map, SHRINK_FLIGHTS, colliding_object=hit).simplest


@dataclass(frozen=True, slots=True, kw_only=True)
class CausesTask(Task):
    """One search of an arm, and the causes of its violations."""

    arm: str
    system: str
    seed: int
    flights: int = FLIGHTS

    @property
    def name(self) -> str:
        """The name of its file."""
        return named(arm=self.arm, system=self.system, seed=self.seed, flights=self.flights)

    @property
    def group(self) -> str:
        """The arms of a system and seed, which fly many scenarios alike."""
        return named(system=self.system, seed=self.seed, flights=self.flights)

    @property
    def map(self) -> str:
        """The map of its seed."""
        return MAPS[self.seed % len(MAPS)]

    def row(self) -> dict[str, Any]:
        """Fly the search, and shrink its violations."""
        plan = plan_of(self.map, self.seed, self.flights)
        signatures, violations = set[str](), 0
        fly = flights_of_group(self.system, self.map, self.group)
        inventory = Inventory(fly=fly)
        for violating in self._violations(fly, plan.population):
            if violating.number <= plan.population:
                continue
            violations += 1
            signatures.add(violating.flight.signature)
            if violating.flight.result.verdict.violation_type != "V":
                inventory.add(violating)
        return {
            **dataclasses.asdict(self),
            "map": self.map,
            "control": plan.population,
            "violations": violations,
            "signatures": len(signatures),
            "causes": [each.to_json() for each in inventory.found],
            "count": len(inventory.causes),
            "asked": inventory.asked.total(),
            "unconfirmed": inventory.unconfirmed,
            "beside": inventory.beside,
            "told": f"{len(inventory.causes)} causes in {violations} violations",
        }

    def _violations(self, fly: Flights, control: int) -> Iterator[Violating]:
        """Yield the violations of the search in the order of its flights."""
        if self.arm == FROZEN:
            for number, scenario in enumerate(self._frozen(control), start=1):
                flown = fly(fly.job, scenario) if scenario else None
                if scenario and flown and flown.result.verdict.violation:
                    yield Violating(number=number, how="frozen", scenario=scenario, flight=flown)
            return
        arm, plan = arm_named(self.arm), plan_of(self.map, self.seed, self.flights)
        latest: list[CompletedFlight] = []
        fly_all = functools.partial(fly_each, fly, latest)
        for flight in flights_of(arm, plan, self.flights, fly_all, fly.airframe):
            if flight.result.verdict.violation:
                yield Violating(
                    number=flight.number,
                    how=flight.origin.how,
                    scenario=flight.scenario.replace(dict(flight.result.decided)),
                    flight=latest[0],
                )

    def _frozen(self, control: int) -> Iterator[Scenario | None]:
        """Yield the scenarios of the violations that the older commit's search shows, else None."""
        tree = work_tree()
        words = (SYSTEMS[self.system], self.map, str(self.seed), str(self.flights), str(control))
        done = subprocess.run(
            (sys.executable, Path(__file__).with_name("frozen.py").resolve(), *words),
            cwd=tree,
            env={**os.environ, "PYTHONPATH": str(tree)},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            raise GarlError(f"the search of commit {BEFORE_MOMENTS} failed:\n{done.stderr}")
        for line in done.stdout.splitlines():
            told = json.loads(line)
            yield parse_scenario(told["scenario"]) if told["violates"] else None


@functools.lru_cache(maxsize=1)
def flights_of_group(system: str, map_name: str, group: str) -> Flights:
    """Return the flights that the arms of a group share, in a folder that goes with them."""
    folder = tempfile.TemporaryDirectory(prefix=group)
    fly = flights_for(system, load_map(map_name), Path(folder.name))
    weakref.finalize(fly, folder.cleanup)
    return fly


def work_tree() -> Path:
    """Return the work tree of the commit before moments."""
    return (FOLDER / BEFORE_MOMENTS).resolve()


def make_work_tree() -> None:
    """Check out that commit, unless it is there."""
    if not work_tree().is_dir():
        subprocess.run(
            ("git", "worktree", "add", "--detach", str(work_tree()), BEFORE_MOMENTS), check=True
        )


def tasks(
    arms: Iterable[str], systems: Iterable[str], seeds: Iterable[int], flights: int
) -> list[CausesTask]:
    """Return the searches; all of a seed come before the next one.

    Of the seeds of the judge, the arm that is frozen flies the first two.
    """
    names, kinds = list(systems), list(arms)
    return [
        CausesTask(arm=arm, system=system, seed=seed, flights=flights)
        for seed in seeds
        for system in names
        for arm in kinds
        if arm != FROZEN or (system in SYSTEMS and seed not in SEEDS[len(FROZEN_SEEDS) :])
    ]


def report(rows: Sequence[Row]) -> str:
    """Return the tables in Markdown."""
    if not rows:
        return "nothing is flown"
    arms = list(dict.fromkeys(row["arm"] for row in rows))
    counts, smallest = (
        {
            a: {(r["seed"], r["system"]): len(kept(_shown(r))) for r in rows if r["arm"] == a}
            for a in arms
        }
        for kept in (set, _minimal)
    )
    lines = [
        "Distinct confirmed causes of a search; to garl over pairs of seed and system, with 95 % "
        "intervals; p of the test that flips signs.  The smallest contain no other of the search.",
        "",
        "| arm | searches | causes | violations | signatures | garl less it | garl, times | p "
        "| smallest | garl less it | garl, times | p |",
        "| --- | ---: | --- | ---: | ---: | --- | --- | ---: | --- | --- | --- | ---: |",
    ]
    for arm in arms:
        own = [row for row in rows if row["arm"] == arm]
        cells = [
            str(len(own)),
            mean_of([*counts[arm].values()]).text(1),
            f"{np.mean([int(row['violations']) for row in own]):.1f}",
            f"{np.mean([int(row['signatures']) for row in own]):.1f}",
            *_against(counts, arm),
            mean_of([*smallest[arm].values()]).text(1),
            *_against(smallest, arm),
        ]
        lines.append(f"| {arm} | {' | '.join(cells)} |")
    lines += ["", *_by_system(counts), "", _by_half(rows)]
    commits = sorted({row["commit"] for row in rows})
    return "\n".join([*lines, "", f"Flown at {', '.join(commits)}."])


def _shown(row: Row) -> dict[Cause, int]:
    """Return the causes that a search shows, and the flight that shows each first."""
    return {frozenset(c["cause"]): c["number"] for c in reversed(json.loads(row["causes"]))}


def _minimal(found: Collection[Cause]) -> set[Cause]:
    # A violation that takes no condition is a cause of its own, not a part of each other one.
    return {each for each in found if not any(other < each for other in found if other)}


def _against(counts: Counts, arm: str) -> list[str]:
    ours = counts.get(OURS, {})
    pairs = [(ours[key], value) for key, value in counts[arm].items() if key in ours]
    if arm == OURS or len(pairs) < 2:
        return ["–", "–", "–"]
    own, rival = zip(*pairs, strict=True)
    differences = [a - b for a, b in pairs]
    return [
        mean_of(differences).text(1),
        over_pairs(own, rival, difference=False).text(),
        f"{p_of_signs(differences):.3f}",
    ]


def _by_system(counts: Counts) -> list[str]:
    lines = [f"| system | {' | '.join(counts)} |", f"| --- |{' ---: |' * len(counts)}"]
    for system in dict.fromkeys(system for own in counts.values() for _, system in own):
        alike = [[n for (_, each), n in own.items() if each == system] for own in counts.values()]
        cells = [f"{np.mean(each):.1f}" if each else "–" for each in alike]
        lines.append(f"| {system} | {' | '.join(cells)} |")
    return lines


def _by_half(rows: Sequence[Row]) -> str:
    """Say how many causes are first shown before the children's half of the flights, and in it."""
    told = {row["arm"]: np.zeros(3, dtype=int) for row in rows}
    for row in rows:
        shown, half = _shown(row), (int(row["control"]) + int(row["flights"])) / 2
        later = {cause for cause, number in shown.items() if number > half}
        told[row["arm"]] += len(shown) - len(later), len(later), len(later & _minimal(shown))
    parts = [f"{arm} {', '.join(map(str, counts))}" for arm, counts in told.items()]
    return f"Causes before the children's half; new in it; smallest of these: {'; '.join(parts)}."
