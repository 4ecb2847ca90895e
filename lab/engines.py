"""Fly saved cases by both physics engines, and compare how they end: docs/engines.csv.

Run it in the folder of the cases: ``python -m lab.engines`` flies all below scenarios/regressions,
and prints the table of those that end otherwise.
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

from pytest_garl import cpu_dispatch, engine
from pytest_garl.cases.case import Case
from pytest_garl.cases.case_file import load_case
from pytest_garl.cases.replay import system_of
from pytest_garl.execution.fly_and_judge import judged, time_limit_s
from pytest_garl.files.run_files import CASES_FOLDER
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.ending import ending_of

BULLET, MUJOCO = get_args(engine.Engine)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A case flown by one engine; ``saved`` is the signature in its file, without the condition.

    ``as_saved`` is whether the flight equals the recorded one to the byte.
    """

    case: str
    gates: bool
    engine: str
    saved: str
    signature: str
    outcome: str
    distance_m: float
    elapsed_s: float
    as_saved: bool
    cpu_s: float


def flown(case: Case, by: engine.Engine, folder: Path) -> Row:
    """Fly a case by an engine, and judge it by the built-in verdict."""
    engine.prefer(by)
    map, system = load_map(case.scenario.map), system_of(case, folder)
    began = time.process_time()
    limit_s = time_limit_s(case.limits)
    flight = fly(case.scenario, system, case.behaviour.policy, map=map, time_limit_s=limit_s)
    cpu_s = time.process_time() - began
    return Row(
        case=f"{case.system.partition(':')[0].rpartition('.')[2]} {case.id}",
        gates=case.gates,
        engine=by,
        saved=case.ending,
        signature=ending_of(judged(flight, case.limits).signature),
        outcome=flight.outcome,
        distance_m=round(flight.final_distance_m, 3),
        elapsed_s=round(flight.elapsed_s, 2),
        as_saved=flight.sha256 == case.evidence.trajectory_sha256,
        cpu_s=round(cpu_s, 2),
    )


def report(rows: Sequence[Row]) -> str:
    """Return what differs between the engines, in Markdown."""
    pairs = [
        (first, second)
        for first, second in zip(rows[::2], rows[1::2], strict=True)
        if first.signature != second.signature
    ]
    lines = ["| case | gates | Bullet | MuJoCo |", "| --- | --- | --- | --- |"]
    for one, other in pairs:
        ends = (
            f"{each.signature or each.outcome}, {each.elapsed_s:.1f} s" for each in (one, other)
        )
        lines.append(f"| {one.case} | {'yes' if one.gates else 'no'} | {' | '.join(ends)} |")
    count, cpu = len(rows) // 2, [sum(row.cpu_s for row in rows[first::2]) for first in (0, 1)]
    lines += [
        "",
        f"{count} cases, {count - len(pairs)} with the same signature; of Bullet's flights "
        f"{sum(row.as_saved for row in rows[::2])} equal the recorded one to the byte. CPU per "
        f"flight: {cpu[0] / count:.2f} s and {cpu[1] / count:.2f} s, {cpu[1] / cpu[0]:.2f} times.",
    ]
    return "\n".join(lines)


def main() -> None:
    """Fly the cases of the current folder, or those that are named, by both engines."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="*", type=Path, help="saved cases (default: all)")
    parser.add_argument("--out", type=Path, help="the CSV file to write")
    asked = parser.parse_args()
    if not cpu_dispatch.was_started_for_flights():
        # NumPy is loaded by now, and has chosen its instructions.
        environment = {**os.environ, **cpu_dispatch.environment()}
        os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], environment)
    folder = Path.cwd()
    rows = [
        flown(load_case(file), by, folder)
        for file in asked.files or sorted((folder / CASES_FOLDER).rglob("*.toml"))
        for by in (BULLET, MUJOCO)
    ]
    if asked.out is not None:
        with asked.out.open("w", newline="", encoding="utf-8") as out:
            writer = csv.DictWriter(
                out, [field.name for field in dataclasses.fields(Row)], lineterminator="\n"
            )
            writer.writeheader()
            writer.writerows(map(dataclasses.asdict, rows))
    print(report(rows))


if __name__ == "__main__":
    main()
