r"""Distances and times of real landings, from which the study of the gate draws.

    garl baseline save --system landing_systems.opencv_mls:OpenCvLandingSystem --count 60 \
        --out /tmp/base.toml
    python -m studies.gate landings --baseline /tmp/base.toml

writes a row for each landing within the limits to ``docs/gate.csv``.
"""

from __future__ import annotations

import csv
from pathlib import Path

from pytest_garl.baselines.file import load_baseline

COLUMNS = ("system", "map", "scenario", "distance_m", "time_s")


def write_landings(baseline: Path, out: Path) -> None:
    """Write the landings of a baseline as CSV."""
    with out.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for each in load_baseline(baseline).sets:
            for index, flight in enumerate(each.flights):
                if flight.summary.landed:
                    summary = flight.summary
                    name = each.scenario_name(index)
                    writer.writerow(
                        (each.system, each.map, name, summary.distance_m, summary.time_s)
                    )
