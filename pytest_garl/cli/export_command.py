"""``garl export``: write a flight as a file for viewers of robots' recordings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from pytest_garl.cli.flight_options import flight_options
from pytest_garl.cli.named_flight import FlightName, NamedFlight
from pytest_garl.cli.shared import say
from pytest_garl.errors import OptionError
from pytest_garl.files.atomic import check_writable
from pytest_garl.reports.mcap.sdk import check_sdk

SUFFIX = ".mcap"


@click.command()
@flight_options
@click.option(
    "--mcap",
    metavar="FILE",
    type=click.Path(path_type=Path),
    required=True,
    help="Write an MCAP file for Foxglove and Rerun, such as flight.mcap (extra: mcap).",
)
def export(mcap: Path, **named: Any) -> None:
    """Write a flight as an MCAP file.

    It holds pictures, poses, bodies, plans, events and margins. SLOT is a slot of the last run,
    such as court-g03-s17; nothing is flown. CASE is a saved case, by its name or its .toml file; it
    is flown again if the ledger has no record of its flight. FILE is a flight's record (.npz).
    docs/export.md lists the topics.
    """
    if mcap.suffix != SUFFIX:
        raise OptionError(
            f"--mcap: found {mcap}, expected a name that ends in {SUFFIX}, by which viewers know "
            "the file"
        )
    # Checked before anything is flown or drawn.
    check_sdk()
    check_writable(mcap)
    found = _without_unused_camera(FlightName(**named).find())
    from pytest_garl.reports.mcap.writer import write_mcap

    written = write_mcap(found, mcap)
    if found.no_pictures:
        without = "no pictures" if found.place else "no pictures, no bodies"
        say(f"garl: {without}: {found.no_pictures}", err=True)
    for note in found.notes:
        say(f"garl: {note}", err=True)
    say(
        f"{mcap}: {found.flight.elapsed_s:.1f} s of flight, {written.messages} messages, "
        f"{written.pictures} pictures, {written.bytes / 1e6:.1f} MB, {found.how}"
    )


def _without_unused_camera(found: NamedFlight) -> NamedFlight:
    steps, place = found.flight.steps, found.place
    # A camera that is on knows how large the marker would be, whatever it shows.
    if place is None or place.camera is None or any(step.marker_px > 0 for step in steps):
        return found
    why = "the landing system used no camera" if steps else "the record holds no camera frames"
    return replace(found, place=replace(place, camera=None), no_pictures=why)
