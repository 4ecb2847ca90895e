"""Judge 1: how many flights a search takes to find a planted fault."""

from __future__ import annotations

import dataclasses
import functools
import random
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from lab.arms import arm_named
from lab.faults.catalogue import FAULTS, PLACEBO, fault_named
from lab.faults.fault import Fault
from lab.judges.flights import named
from lab.judges.intervals import Values, over_clusters
from lab.one_search import Flown, flights_of, flown_by, plan_of
from lab.table import ResultTable, Row
from pytest_garl.landing_system import airframe_of
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.npc_policy import PolicySpec

FLIGHTS, MORE_FLIGHTS = 100, 400
SEEDS, MORE_SEEDS = tuple(range(23, 28)), tuple(range(23, 26))
ARMS, MORE_ARMS = ("random", "exploring+", "garl", "shuffled"), ("garl", "exploring+")
OURS = "garl"
TWIN_SHARES = (0.98, 0.99, 1.01, 1.02)
"""The approach of a twin, as a share of that of the system."""
LEAST_FAULTY, MOST_CONTROLS = 3, 1
"""Of four twins of the faulty system so many must violate, and of those of the control at most."""
WITHIN = (10, 25, 50, 100)
KEPT = 128
"""So many flights of a faulty system are kept for the next arms: all of one search, and more."""
TABLE = ResultTable(
    file=Path("docs/results/judge-faults.csv"),
    columns=(
        *("arm", "fault", "seed", "flights", "map", "control", "found_at", "how", "signature"),
        *("unconfirmed", "masked", "commit"),
    ),
    key=("arm", "fault", "seed", "flights"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultTask:
    """One search for a fault by an arm."""

    arm: str
    fault: str
    seed: int
    flights: int = FLIGHTS

    @property
    def name(self) -> str:
        """The name of its file."""
        return named(arm=self.arm, fault=self.fault, seed=self.seed, flights=self.flights)

    @property
    def group(self) -> str:
        """The arms of a fault and seed, which fly many scenarios alike."""
        return named(fault=self.fault, seed=self.seed, flights=self.flights)

    def row(self) -> dict[str, Any]:
        """Search until the first confirmed find.

        ``unconfirmed`` counts candidates that twins did not confirm, ``masked`` the violations that
        the control shares.
        """
        fault, arm = fault_named(self.fault), arm_named(self.arm)
        plan = plan_of(fault.map, self.seed, self.flights)
        counts = {"unconfirmed": 0, "masked": 0}
        row = {**dataclasses.asdict(self), "map": fault.map, "control": plan.population}
        lost = {"found_at": None, "how": "", "signature": "", "told": "not found"}

        def fly_all(npcs: PolicySpec, scenarios: Sequence[Scenario]) -> Iterator[Flown]:
            return (flown_once(fault.faulty, npcs, each) for each in scenarios)

        airframe = airframe_of(fault.faulty)
        for flight in flights_of(arm, plan, self.flights, fly_all, airframe):
            if not flight.result.verdict.violation:
                continue
            if violates(fault.control, flight.npcs, flight.scenario):
                counts["masked"] += 1
            elif not confirmed(fault, flight.scenario, flight.npcs):
                counts["unconfirmed"] += 1
            else:
                found = {
                    "found_at": flight.number,
                    "how": flight.origin.how,
                    "signature": flight.result.signature,
                    "told": f"found in flight {flight.number}",
                }
                return {**row, **counts, **found}
        return {**row, **counts, **lost}


def confirmed(fault: Fault, scenario: Scenario, npcs: PolicySpec) -> bool:
    """Whether twins of a candidate confirm it."""
    return (
        _violating(fault.faulty, scenario, npcs) >= LEAST_FAULTY
        and _violating(fault.control, scenario, npcs) <= MOST_CONTROLS
    )


def _violating(system: Any, scenario: Scenario, npcs: PolicySpec) -> int:
    return sum(violates(twin_of(system, share), npcs, scenario) for share in TWIN_SHARES)


@functools.lru_cache(maxsize=KEPT)
def flown_once(system: Any, npcs: PolicySpec, scenario: Scenario) -> Flown:
    """Fly a landing system through a scenario, unless it is one of the latest flights."""
    return flown_by(system, npcs, scenario)


@functools.cache
def violates(system: Any, npcs: PolicySpec, scenario: Scenario) -> bool:
    """Whether a landing system violates a property in a scenario."""
    return flown_by(system, npcs, scenario).result.verdict.violation


@functools.cache
def twin_of(system: Any, share: float) -> Any:
    """Return the system with another speed of its approach."""
    parameters = dataclasses.replace(
        system.parameters, approach_mps=share * system.parameters.approach_mps
    )
    return type(f"{system.__name__}Twin", (system,), {"parameters": parameters})


def tasks(
    arms: Iterable[str], faults: Iterable[str], seeds: Iterable[int], flights: int
) -> list[FaultTask]:
    """Return the searches; all arms of a fault come before the next one, and all faults of a seed.

    The faults of a seed are in a random order: the first of them are a random part.
    """
    names, kinds = list(faults), list(arms)
    found = []
    for seed in seeds:
        order = names.copy()
        random.Random(seed).shuffle(order)
        found += [
            FaultTask(arm=arm, fault=fault, seed=seed, flights=flights)
            for fault in order
            for arm in kinds
        ]
    return found


def missed(rows: Iterable[Row], arms: Iterable[str], seeds: Iterable[int]) -> list[FaultTask]:
    """Return a longer search for each fault that an arm missed."""
    wanted = {*map(str, seeds)}
    return [
        FaultTask(arm=row["arm"], fault=row["fault"], seed=int(row["seed"]), flights=MORE_FLIGHTS)
        for row in rows
        if row["flights"] == str(FLIGHTS) and not row["found_at"]
        if row["arm"] in arms and row["seed"] in wanted
    ]


Found = Mapping[tuple[str, str, str], int]
"""The flight that found a fault, by arm, fault and seed; a miss counts as all flights."""


def report(rows: Sequence[Row]) -> str:
    """Return the tables in Markdown, of the faults and seeds that all arms have flown."""
    all_ = [row for row in rows if row["flights"] == str(FLIGHTS)]
    short, left_out = flown_by_all_arms([row for row in all_ if row["fault"] != PLACEBO.name])
    if not short:
        return "nothing is flown"
    found: Found = {
        (row["arm"], row["fault"], row["seed"]): int(row["found_at"] or FLIGHTS) for row in short
    }
    lost = {(row["arm"], row["fault"], row["seed"]) for row in short if not row["found_at"]}
    arms = list(dict.fromkeys(row["arm"] for row in short))
    control = int(short[0]["control"])
    parts = [_shares(found, lost, arms, control)]
    if OURS in arms:
        parts += [_ratios(found, lost, [arm for arm in arms if arm != OURS], control)]
    chance = [row for row in all_ if row["fault"] == PLACEBO.name]
    parts += [
        _longer([row for row in rows if row["fault"] != PLACEBO.name]),
        _misses(lost, arms),
        _placebo(chance),
    ]
    if left_out:
        parts.append(f"Left out, because not all arms have flown them: {left_out} searches.")
    parts.append(f"Flown at {', '.join(sorted({row['commit'] for row in rows}))}.")
    return "\n\n".join(part for part in parts if part)


def flown_by_all_arms(rows: Sequence[Row]) -> tuple[list[Row], int]:
    """Return the rows of faults and seeds that all arms have flown, and the number of others."""
    arms = len({row["arm"] for row in rows})
    flown = Counter((row["fault"], row["seed"]) for row in rows)
    kept = [row for row in rows if flown[row["fault"], row["seed"]] == arms]
    return kept, len(rows) - len(kept)


def _shares(found: Found, lost: set[Any], arms: Sequence[str], control: int) -> str:
    lines = [
        "Share of faults found, %, over all seeds; flights to the find, of which the first "
        f"{control} are the control.",
        "",
        f"| arm | searches | {' | '.join(f'within {each}' for each in WITHIN)} | flights |",
        f"| --- | ---: |{' ---: |' * len(WITHIN)} ---: |",
    ]
    for arm in arms:
        own = [key for key in found if key[0] == arm]
        shares = [np.mean([_in_time(found, lost, key, most) for key in own]) for most in WITHIN]
        cells = " | ".join(f"{100 * share:.0f}" for share in shares)
        flights = np.mean([found[key] for key in own])
        lines.append(f"| {arm} | {len(own)} | {cells} | {flights:.1f} |")
    return "\n".join(lines)


def _in_time(found: Found, lost: set[Any], key: tuple[str, str, str], most: int) -> bool:
    return key not in lost and found[key] <= most


def _ratios(found: Found, lost: set[Any], rivals: Sequence[str], control: int) -> str:
    lines = [
        f"{OURS} against each rival, paired by fault and seed, with 95 % intervals of a bootstrap "
        "over seeds and families: flights as a multiple, and flights fewer.  After the control: "
        "without what the control found, and without its flights; p of the exact sign test.",
        "",
        "| rival | pairs | flights, times | flights fewer | pairs after the control | times "
        "| fewer | earlier : later : alike | p |",
        "| --- | ---: | --- | --- | ---: | --- | --- | --- | ---: |",
    ]
    for rival in rivals:
        cells: list[str] = []
        for after in (0, control):
            own, other, families = paired(found, lost, rival, after)
            count = int((~np.isnan(own)).sum())
            if not count:
                cells += ["0", "–", "–"]
                continue
            cells += [
                str(count),
                over_clusters(own, other, families).text(),
                over_clusters(own, other, families, difference=True).text(1),
            ]
        own, other, _ = paired(found, lost, rival)
        earlier, later = int((own < other).sum()), int((own > other).sum())
        alike = int((own == other).sum())
        p = binomtest(earlier, earlier + later).pvalue if earlier + later else 1.0
        lines.append(f"| {rival} | {' | '.join(cells)} | {earlier} : {later} : {alike} | {p:.4f} |")
    return "\n".join(lines)


def paired(
    found: Found, lost: set[Any], rival: str, after: int = 0
) -> tuple[Values, Values, list[str]]:
    """Return the flights of ours and of a rival, (faults, seeds), and the families of the faults.

    Flights count from ``after`` on.  A pair is nan if one of them is not flown, or if one of them
    found the fault before.
    """
    faults = [each for each in FAULTS if any(key[1] == each.name for key in found)]
    seeds = sorted({key[2] for key in found})
    tables = np.full((2, len(faults), len(seeds)), np.nan)
    for i, fault in enumerate(faults):
        for j, seed in enumerate(seeds):
            keys = [(arm, fault.name, seed) for arm in (OURS, rival)]
            if all(key in found and (key in lost or found[key] > after) for key in keys):
                tables[:, i, j] = [found[key] - after for key in keys]
    return tables[0], tables[1], [fault.family for fault in faults]


def _longer(rows: Sequence[Row]) -> str:
    own = [row for row in rows if row["flights"] == str(MORE_FLIGHTS)]
    lines = []
    for arm in dict.fromkeys(row["arm"] for row in own):
        all_ = [row for row in own if row["arm"] == arm]
        hits = sum(bool(row["found_at"]) for row in all_)
        lines.append(
            f"In {MORE_FLIGHTS} flights {arm} found {hits} of the {len(all_)} faults that it had "
            f"missed in {FLIGHTS} flights of these seeds."
        )
    return "\n".join(lines)


def _misses(lost: set[tuple[str, str, str]], arms: Sequence[str]) -> str:
    lines = []
    for arm in arms:
        seeds: dict[str, int] = {}
        for each in lost:
            if each[0] == arm:
                seeds[each[1]] = seeds.get(each[1], 0) + 1
        named_ = ", ".join(f"{fault} ({count})" for fault, count in sorted(seeds.items()))
        lines.append(f"Missed by {arm}, with the number of seeds: {named_ or 'none'}.")
    return "\n".join(lines)


def _placebo(rows: Sequence[Row]) -> str:
    """Return in how many searches the system without a fault was found."""
    if not rows:
        return ""
    hits = sum(bool(row["found_at"]) for row in rows)
    return f"Twins confirmed a find of the placebo, which has no fault, in {hits} of {len(rows)}."
