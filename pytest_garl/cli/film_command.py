"""``garl film``: draw any flight as a film: of a run, of a saved case, or of a flight's file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pytest_garl.cli.flight_options import flight_options
from pytest_garl.cli.named_flight import CASE, RECORD, FlightName, NamedFlight
from pytest_garl.cli.shared import say
from pytest_garl.errors import GarlError
from pytest_garl.reports.film import save_video
from pytest_garl.reports.film.film_file import check_film_file


@click.command()
@flight_options
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    help="The film: an .mp4, or a small .gif.  [default: the flight's name and .mp4]",
)
@click.option(
    "--last",
    "last_s",
    metavar="SECONDS",
    type=click.FloatRange(min=0, min_open=True),
    help="Show only the last seconds of the flight.",
)
def film(out: Path | None, last_s: float | None, **named: Any) -> None:
    """Draw a flight as a film.

    It needs ffmpeg, or the extra: video. SLOT is a slot of the last run, such as court-g03-s17. Its
    film is drawn from the flight's record.

    CASE is a saved case: its name, or its .toml file. Its film is drawn from the record if the
    ledger has its flight; if not, the case is flown again. Nobody judges it.

    FILE is a flight's record (.npz). The ledger tells its scenario and its camera; without one give
    --scenario and --system.
    """
    file = Path(named["flight"])
    path = out or Path(f"{file.stem if file.suffix in (RECORD, CASE) else file.name}.mp4")
    # Checked before anything is flown or drawn.
    check_film_file(path)
    found = FlightName(**named).find(pictures=True)
    draw(found, path, last_s)
    elapsed_s = found.flight.elapsed_s
    seconds = min(elapsed_s, last_s or elapsed_s)
    part = "the last " if seconds < elapsed_s else ""
    size = path.stat().st_size / 1e6
    say(f"{path}: {part}{seconds:.1f} s, {size:.1f} MB, {found.how}")


def draw(found: NamedFlight, path: Path, last_s: float | None = None) -> None:
    """Draw the film of a flight; raise GarlError if its pictures cannot be drawn."""
    place = found.place
    if place is None or place.camera is None:
        raise GarlError(f"{found.name}: no film can be drawn: {found.no_pictures}")
    save_video(
        path,
        found.flight,
        place.placed,
        place.camera,
        found.signature,
        last_s=last_s,
    )
    for note in found.notes:
        say(f"garl: {note}", err=True)
