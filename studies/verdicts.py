"""Random flights without NPCs: how they end, by type and cause.

``python -m studies.verdicts`` flies each landing system in random scenarios of the confined weather
on each map, keeps the records in a folder, and writes ``docs/verdicts.csv``: a row per flight.
``--judge`` judges the records anew without flying.  The scenarios depend on the map and their
number alone.
"""

from __future__ import annotations

import argparse
import csv
import importlib
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from pytest_garl import cpu_dispatch
from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.flight.flight_file import load, save
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.touchdowns import landed_s
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS

SEED = 26
MAPS = ("court", "lawn")
SYSTEMS = {
    "opencv": "landing_systems.opencv_mls:OpenCvLandingSystem",
    "tphyolo": "landing_systems.tphyolo_mls:TphYoloLandingSystem",
    "mm": "landing_systems.mm_mls:MultiModuleLandingSystem",
}
COLUMNS = (
    "system",
    "map",
    "flight",
    "outcome",
    "no_landing",
    "signature",
    "kind",
    "paper",
    "findings",
    "off_m",
    "landed_s",
)
Task = tuple[str, str, int, str]


def scenario_of(map_name: str, number: int) -> Scenario:
    """Return a random scenario without NPCs."""
    map = load_map(map_name)
    drawn = random_scenarios(map, genome_for(map), SEED, number, 1)[0]
    return drawn.without(*(name for name, _ in map.present_objects))


def record(task: Task) -> Path:
    """Fly a task unless its record is there; return the record's file."""
    who, map_name, number, folder = task
    file = Path(folder) / f"{who}-{map_name}-{number:03d}.npz"
    if not file.exists():
        import cv2

        cv2.setNumThreads(1)
        module, _, name = SYSTEMS[who].partition(":")
        system: Callable[[], Any] = getattr(importlib.import_module(module), name)
        scenario = scenario_of(map_name, number)
        save(fly(scenario, system, policy_spec("stationary"), map=load_map(map_name)), file)
    return file


def row_of(task: Task) -> dict[str, object]:
    """Return the row of a flight in the table."""
    who, map_name, number, _ = task
    flight = load(record(task))
    verdict = judge(flight, DEFAULT_LIMITS)
    landed = flight.outcome == "landed"
    return {
        "system": who,
        "map": map_name,
        "flight": number,
        "outcome": flight.outcome,
        "no_landing": verdict.no_landing,
        "signature": verdict.ending,
        "kind": verdict.cause,
        "paper": int(verdict.paper_violation),
        "findings": " ".join(each.signature for each in verdict.findings),
        "off_m": f"{flight.final_distance_m:.3f}",
        "landed_s": f"{landed_s(flight):.2f}" if landed else "",
    }


def tables(rows: Iterable[dict[str, Any]]) -> str:
    """Return the two tables in Markdown: how flights ended, and the kinds of violation."""
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["system"], row["map"]), []).append(row)
    lines = [
        "| system | map | flights | landed, % | violations, % | by the paper, % | needless "
        "| excused | blocked | findings |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for (system, map_name), own in groups.items():
        no_landing = Counter(row["no_landing"] for row in own)
        found = Counter(name for row in own for name in row["findings"].split())
        total = len(own)
        lines.append(
            f"| {system} | {map_name} | {total} "
            f"| {_percent(sum(row['outcome'] == 'landed' for row in own), total)} "
            f"| {_percent(sum(bool(row['kind']) for row in own), total)} "
            f"| {_percent(sum(int(row['paper']) for row in own), total)} "
            f"| {no_landing['needless']} | {no_landing['excused']} | {no_landing['blocked']} "
            f"| {', '.join(f'{count} {name}' for name, count in sorted(found.items())) or 'none'} |"
        )
    names = sorted({row["kind"] for own in groups.values() for row in own if row["kind"]})
    lines += [
        "",
        f"| kind | {' | '.join(f'{system} {map_name}' for system, map_name in groups)} |",
        f"| --- |{' --- |' * len(groups)}",
    ]
    for name in names:
        counts = [sum(row["kind"] == name for row in own) for own in groups.values()]
        lines.append(f"| {name} | {' | '.join(map(str, counts))} |")
    return "\n".join(lines)


def _percent(count: int, total: int) -> str:
    return f"{100 * count / total:.1f}"


def main() -> None:
    """Fly or judge, write the table, print it."""
    cpu_dispatch.pin()
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=200, help="per system and map (default 200)")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--folder", default=".garl/verdicts", help="of the records")
    parser.add_argument("--out", type=Path, default=Path("docs/verdicts.csv"))
    parser.add_argument("--fly", action="store_true", help="only fly what is missing")
    arguments = parser.parse_args()
    Path(arguments.folder).mkdir(parents=True, exist_ok=True)
    tasks: list[Task] = [
        (who, name, number, arguments.folder)
        for number in range(arguments.flights)
        for name in MAPS
        for who in SYSTEMS
    ]
    context = get_context("spawn")
    with ProcessPoolExecutor(arguments.workers, mp_context=context) as pool:
        if arguments.fly:
            for done, _ in enumerate(pool.map(record, tasks), start=1):
                if done % 20 == 0 or done == len(tasks):
                    print(f"{done} of {len(tasks)} flights", flush=True)
            return
        rows = sorted(pool.map(row_of, tasks), key=lambda row: (row["system"], row["map"]))
    with arguments.out.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    print(tables(rows))


if __name__ == "__main__":
    main()
