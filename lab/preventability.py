"""Which collisions with moving bodies were preventable, and how often placebos escape.

``python -m lab.preventability`` searches with the NPC policy dqn for violations of the three
landing systems on both maps, and asks for each collision with a moving body whether it could have
been prevented.  Two placebos take over in its place: one holds the landing system's last command,
one goes on to the marker and down, blind.  They do so from the state in which the planned escape
was confirmed, and from the state 0.3 s after the body was observable.  The reference pilot, which
knows where everything is, flies the whole scenario among objects that repeat their moves.  The rows
go to ``docs/preventability.csv``; ``--report`` prints the table.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from lab.experiment.pytest_run import run_pytest
from lab.experiment.spec import ExperimentRun
from lab.table import ResultTable, Row, run_study, share
from pytest_garl.cases.case import REACTION_S
from pytest_garl.cases.case_flights import ESCAPE_FLIGHTS, recorded_behaviour
from pytest_garl.cases.clearance import touched_nothing
from pytest_garl.cases.prevention import (
    Collision,
    collision_of,
    prevention_of,
)
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.local_pool import local_pool
from pytest_garl.execution.on_demand import FlyFunction, OnDemandFlights
from pytest_garl.execution.reference import reference_to
from pytest_garl.flight.flight_file import load
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot

SYSTEMS = {
    "OpenCV-MLS": "landing_systems/test_opencv_mls.py",
    "TPHYolo-MLS": "landing_systems/test_tphyolo_mls.py",
    "MM-MLS": "landing_systems/test_mm_mls.py",
}
MAPS = ("court", "lawn")
METHOD = "garl with dqn"
BUDGET = 24
"""Flights of each search, on each map."""
EACH = 10
"""Collisions of each search that are asked."""
FOLDER = Path(".garl/preventability")
AT_A_TIME = 6
TABLE = ResultTable(
    file=Path("docs/preventability.csv"),
    columns=(
        "system",
        "map",
        "slot",
        "signature",
        "answer",
        "inevitable_s",
        "observed_s",
        "flights",
        "hold",
        "hold_touches_nothing",
        "blind",
        "blind_touches_nothing",
        "reference_pilot",
        "hold_late",
        "blind_late",
    ),
    key=("system", "map", "slot"),
)


def question(
    system: str, slot: str, row: LedgerFlight, job: FlightJob, fly: FlyFunction
) -> dict[str, Any]:
    """Return the row of one violation."""
    scenario, map = parse_scenario(row.scenario), load_map(job.map)
    completed = row.completed(Path(job.flights))
    behaviour = recorded_behaviour(completed, scenario, map)
    collision = collision_of(job, scenario, behaviour, completed, map)
    assert collision is not None
    flown: list[FlightJob] = []

    def fly_job(job: FlightJob) -> CompletedFlight:
        flown.append(job)
        return fly(job, scenario)

    found = prevention_of(collision, fly_job, ESCAPE_FLIGHTS)
    pilot = dataclasses.replace(job, system=reference_to(ReferencePilot), npcs=behaviour.policy)
    seen_s = collision.observation_s()
    before_s = 0.0 if seen_s is None else collision.contact.time_s - seen_s - REACTION_S
    early_s = collision.takeover_s(before_s)
    hold, hold_lenient = placebo(collision, "hold", early_s, fly)
    blind, blind_lenient = placebo(collision, "blind", early_s, fly)
    reference_pilot = int(not fly(pilot, scenario).signature)
    late_s = next((job.takeover.from_s for job in flown[-1:] if job.takeover), math.inf)
    return {
        "system": system,
        "map": job.map,
        "slot": slot,
        "signature": row.signature,
        "answer": found.answer,
        "inevitable_s": "" if found.inevitable_s is None else found.inevitable_s,
        "observed_s": "" if found.observed_s is None else found.observed_s,
        "flights": len(flown),
        "hold": hold,
        "hold_touches_nothing": hold_lenient,
        "blind": blind,
        "blind_touches_nothing": blind_lenient,
        "reference_pilot": reference_pilot,
        "hold_late": placebo(collision, "hold", late_s, fly)[0],
        "blind_late": placebo(collision, "blind", late_s, fly)[0],
    }


def placebo(
    collision: Collision, pilot: Literal["hold", "blind"], from_s: float, fly: FlyFunction
) -> tuple[int | str, int | str]:
    """Return whether a placebo escapes by the same definition, and whether it touches no body.

    Both are empty if it would take over after the contact.
    """
    if from_s >= collision.contact.time_s:
        return "", ""
    completed = fly(collision.job_of(pilot, from_s), collision.scenario)
    with collision.world() as world:
        escapes = collision.survives(completed, from_s, world)
    touches_nothing = completed.record.exists() and touched_nothing(
        load(completed.record), collision.until_s
    )
    return int(escapes), int(touches_nothing)


def report(rows: list[Row]) -> str:
    """Return the table in Markdown: a line for each system, and one for all."""
    lines = [
        "| system | collisions | preventable | sensor-limited | unpreventable | not decided "
        "| time to inevitable collision, s | first observed, s before |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    groups = [(name, [row for row in rows if row["system"] == name]) for name in SYSTEMS]
    for name, own in (*groups, ("all", rows)):
        if own:
            counts = [
                str(sum(row["answer"] == answer for row in own))
                for answer in ("preventable", "sensor-limited", "unpreventable", "not asked")
            ]
            cells = (name, str(len(own)), *counts, quartiles(own, "inevitable_s"))
            lines.append(f"| {' | '.join(cells)} | {quartiles(own, 'observed_s')} |")
    lines += ["", "| who flies on | asked | escapes |", "| --- | --- | --- |"]
    planned = sum(row["answer"] in ("preventable", "sensor-limited") for row in rows)
    lines.append(f"| planned escape, confirmed | {len(rows)} | {share(planned, len(rows))} |")
    in_time = [row for row in rows if row["hold"]]
    prevented = sum(row["answer"] == "preventable" for row in in_time)
    lines.append(
        f"| planned escape, 0.3 s after first observation | {len(in_time)} "
        f"| {share(prevented, len(in_time))} |"
    )
    for name, column in (
        ("placebo: last command held, from the state of the escape", "hold_late"),
        ("placebo: blind descent, from the state of the escape", "blind_late"),
        ("placebo: last command held, 0.3 s after first observation", "hold"),
        ("the same, touches no body", "hold_touches_nothing"),
        ("placebo: blind descent, 0.3 s after first observation", "blind"),
        ("the same, touches no body", "blind_touches_nothing"),
        ("reference pilot, whole flight, no violation", "reference_pilot"),
    ):
        asked = [int(row[column]) for row in rows if row[column]]
        lines.append(f"| {name} | {len(asked)} | {share(sum(asked), len(asked))} |")
    return "\n".join(lines)


def quartiles(rows: Sequence[Row], column: str) -> str:
    """Return the median and the quartiles of a column."""
    values = [float(row[column]) for row in rows if row[column]]
    if not values:
        return "–"
    low, middle, high = np.percentile(values, (25, 50, 75))
    return f"{middle:.1f} ({low:.1f} to {high:.1f})"


def fly_missing(arguments: argparse.Namespace) -> None:
    """Search, and ask for the collisions that the table lacks."""
    known = TABLE.keys()
    FOLDER.mkdir(parents=True, exist_ok=True)
    path = FOLDER / "ledger.sqlite"
    own = Ledger(path) if path.is_file() else Ledger.create(path, {})
    pool = local_pool(own.queue, arguments.workers)
    try:
        for system, tests in SYSTEMS.items():
            run = ExperimentRun(
                system=system, tests=tests, maps=MAPS, method=METHOD, seed=0, budget=BUDGET
            )
            found = Ledger(run_pytest(run, FOLDER / run.folder, arguments.workers, _ignore))
            wanted = {
                name: function
                for name, function in questions(system, found, arguments.each).items()
                if tuple(name.split(" ")) not in known
            }
            for start in range(0, len(wanted), AT_A_TIME):
                batch = dict([*wanted.items()][start : start + AT_A_TIME])
                TABLE.append(OnDemandFlights(own, pool, lambda: None).run(batch).values())
    finally:
        pool.close()


def questions(
    system: str, ledger: Ledger, each: int
) -> dict[str, functools.partial[dict[str, Any]]]:
    """Return the questions of a system's searches by system, map and slot."""
    functions: dict[str, functools.partial[dict[str, Any]]] = {}
    for search in dict.fromkeys(row.id.search for row in ledger.queries.violating()):
        text = ledger.job(search)
        assert text is not None
        job = parse_job(text)
        rows = [
            row
            for row in ledger.queries.violating()
            if row.id.search == search and row.signature.startswith("IV:")
        ]
        for row in rows[:each]:
            slot = f"g{row.id.slot.generation:02d}-s{row.id.slot.index:02d}"
            name = f"{system} {job.map} {slot}"
            functions[name] = functools.partial(question, system, slot, row, job)
    return functions


def _ignore(progress: object) -> None:
    """Show no progress of the search."""


def main() -> None:
    """Ask for the missing collisions, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--each", type=int, default=EACH)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    run_study(parser, TABLE, report, fly_missing)


if __name__ == "__main__":
    main()
