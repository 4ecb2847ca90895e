"""Which group of conditions hurts whom: each alone at the harsh end of its range in `field`.

``python -m studies.groups`` flies what ``docs/groups.csv`` lacks: random places of the marker, no
NPCs, one group (or cause of weather) at its end and everything else nominal, by each landing system
and by the reference pilot.  A flight of a number has the same place and seed with every group.  The
end is the one farther from nominal; of two equal ones, and of what has no harsh end, such as a
direction, the flight's number draws one.  ``--report`` writes the table into docs/domain.md.
"""

from __future__ import annotations

import argparse
import importlib
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from pytest_garl import cpu_dispatch
from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.domains.domain import ABSENT
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.domains.reader import domain_named
from pytest_garl.scenarios.genes import OFF, ON, Genome, Property
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS
from studies.table import Key, ResultTable, Row, run_study

DOMAIN = "field"
SEED = 27
MAPS = ("court", "lawn")
NONE = "none"
"""The row in which everything is nominal."""
EQUAL = ("decoy-2", "decoy-3")
"""Groups that differ from ``decoy-1`` in their number only."""
SYSTEMS = {
    "pilot": "pytest_garl.simulation.system_under_test.reference_pilot:ReferencePilot",
    "opencv": "landing_systems.opencv_mls:OpenCvLandingSystem",
    "tphyolo": "landing_systems.tphyolo_mls:TphYoloLandingSystem",
    "mm": "landing_systems.mm_mls:MultiModuleLandingSystem",
}
DOCS = Path(__file__).parents[1] / "docs"
TABLE = ResultTable(
    file=DOCS / "groups.csv",
    columns=("group", "system", "flight", "map", "outcome", "no_landing", "kind", "signature"),
    key=("group", "system", "flight"),
)
BEGIN = "<!-- each group alone: python -m studies.groups --report -->\n"
END = "<!-- end of each group alone -->\n"


def genome_on(map_name: str) -> Genome:
    """Return the genome of the domain on a map, without NPCs."""
    return genome_of(replace(domain_named(DOMAIN), npc_behaviour=ABSENT), load_map(map_name))


def group_names() -> tuple[str, ...]:
    """Return the names of what can act alone, after the row without any; of equal decoys one."""
    names = (gene.name for gene in genome_on(MAPS[0]).genes if gene.is_optional)
    return (NONE, *(name for name in names if name not in EQUAL))


def scenario_of(group: str, number: int) -> Scenario:
    """Return the scenario in which only ``group`` acts, at the end of its range."""
    map = load_map(MAPS[number % len(MAPS)])
    genome = genome_on(map.name)
    place = np.random.default_rng([SEED, number])
    ends = np.random.default_rng([SEED, number, 1])
    row: list[float] = []
    for gene in genome.genes:
        acts = gene.name == group
        if gene.is_optional:
            row.append(ON if acts else OFF)
            row += [_end(each, ends) if acts else each.nominal for each in gene.values]
        else:
            row += [float(place.uniform(each.low, each.high)) for each in gene.values]
    seed = int(place.integers(2**32))
    return repair(decode(np.array(row), genome, map=map.name, seed=seed), map)


def _end(item: Property, rng: np.random.Generator) -> float:
    if not item.outward:
        return float(rng.uniform(item.low, item.high))
    below, above = item.nominal - item.low, item.high - item.nominal
    if np.isclose(below, above):
        return item.high if rng.random() < 0.5 else item.low
    return item.high if above > below else item.low


def row_of(key: Key) -> dict[str, Any]:
    """Fly a row of the table."""
    import cv2

    cv2.setNumThreads(1)
    group, who, text = key
    scenario = scenario_of(group, int(text))
    module, _, name = SYSTEMS[who].partition(":")
    system: Callable[[], Any] = getattr(importlib.import_module(module), name)
    flight = fly(scenario, system, policy_spec("stationary"), map=load_map(scenario.map))
    verdict = judge(flight, DEFAULT_LIMITS)
    return {
        "group": group,
        "system": who,
        "flight": int(text),
        "map": scenario.map,
        "outcome": flight.outcome,
        "no_landing": verdict.no_landing,
        "kind": verdict.cause,
        "signature": verdict.ending,
    }


def report(rows: Iterable[Row]) -> str:
    """Return the table in Markdown: a group a row, a landing system a column."""
    cells: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        cells.setdefault((row["group"], row["system"]), []).append(row)
    flown = sorted({len(own) for own in cells.values()})
    names = [name for name in group_names() if any(group == name for group, _ in cells)]
    head = [
        f"{' to '.join(str(each) for each in dict.fromkeys((flown[0], flown[-1])))} flights a cell."
        if flown
        else "No flight yet.",
        "",
        f"| group | {' | '.join(SYSTEMS)} |",
        f"| --- |{' --- |' * len(SYSTEMS)}",
    ]
    lines = [
        f"| {name} | {' | '.join(_cell(cells.get((name, who), [])) for who in SYSTEMS)} |"
        for name in names
    ]
    return "\n".join([*head, *lines])


def _cell(rows: list[Row]) -> str:
    """Return how flights ended: share that landed, violations by kind, gave up by cause."""
    if not rows:
        return "–"
    landed = sum(row["outcome"] == "landed" for row in rows)
    ends: Mapping[str, int] = Counter(row["kind"] for row in rows if row["kind"])
    causes = Counter(
        f"gave up, {row['no_landing']}"
        for row in rows
        if not row["kind"] and row["no_landing"] and row["outcome"] != "landed"
    )
    parts = [f"{count} {name}" for name, count in sorted({**ends, **causes}.items())]
    return "; ".join([f"{100 * landed / len(rows):.0f} % landed", *parts])


def with_table(page: str, table: str) -> str:
    """Return the page with the table between its two marks."""
    head, begin, rest = page.partition(BEGIN)
    _, end, tail = rest.partition(END)
    if not begin or not end:
        raise SystemExit(f"docs/domain.md: found no lines {BEGIN!r} and {END!r}")
    return f"{head}{begin}\n{table}\n\n{end}{tail}"


def write_report(rows: list[Row]) -> str:
    """Write the table into its page and return it."""
    page, table = DOCS / "domain.md", report(rows)
    page.write_text(with_table(page.read_text(), table))
    return table


def fly_all(arguments: argparse.Namespace) -> None:
    """Fly what the table lacks, all groups and systems of a number before the next."""
    known = TABLE.keys()
    keys: list[Key] = [
        (group, who, str(number))
        for number in range(arguments.flights)
        for group in arguments.group or group_names()
        for who in SYSTEMS
        if (group, who, str(number)) not in known
    ]
    cpu_dispatch.pin()
    context = get_context("spawn")
    with ProcessPoolExecutor(arguments.workers, mp_context=context) as pool:
        for done, row in enumerate(pool.map(row_of, keys), start=1):
            print(f"{done} of {len(keys)}: ", end="")
            TABLE.append([row])


def main() -> None:
    """Fly or report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=100, help="a group and system (default 100)")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--group", nargs="+", choices=group_names(), help="only these")
    run_study(parser, TABLE, write_report, fly_all)


if __name__ == "__main__":
    main()
