"""``garl export``: write a flight as a file for viewers of robots' recordings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from pytest_garl.cli.cases import FOLDER
from pytest_garl.errors import OptionError
from pytest_garl.files.atomic import check_writable
from pytest_garl.messages import printable
from pytest_garl.regressions.corpus import Corpus
from pytest_garl.reports.mcap.sdk import check_sdk

if TYPE_CHECKING:
    from pytest_garl.cli.named_flight import NamedFlight
    from pytest_garl.reports.mcap.source import Place

SUFFIX = ".mcap"


@click.command()
@click.argument("flight", metavar="SLOT|CASE|FILE")
@click.option(
    "--mcap",
    metavar="FILE",
    type=click.Path(path_type=Path),
    required=True,
    help="Write an MCAP file for Foxglove and Rerun, such as flight.mcap (extra: mcap).",
)
@click.option(
    "--ledger",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Ledger of the run with the slot or the record (default: .garl/ledger.sqlite).",
)
@FOLDER
def export(flight: str, mcap: Path, ledger: Path | None, folder: Path) -> None:
    """Write a flight with its pictures, poses, bodies, plans, events and margins as an MCAP file.

    SLOT is a flight of the run, such as court-g03-s17; nothing is flown. CASE is a saved case, by
    file or id; it is flown again, as `garl cases replay` does. FILE is a flight's record (.npz).
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
    from pytest_garl.cli.named_flight import named_flight

    root = Path.cwd()
    corpus = Corpus(folder, (root / "scenarios" / "maps",))
    found = named_flight(flight, corpus, root, ledger)
    from pytest_garl.reports.mcap.source import Export
    from pytest_garl.reports.mcap.writer import write_mcap

    written = write_mcap(
        Export(
            name=found.name,
            flight=found.flight,
            signature=found.signature,
            limits=found.limits,
            place=_place(found),
        ),
        mcap,
    )
    for note in found.notes:
        click.echo(printable(f"garl: {note}"), err=True)
    megabytes = written.bytes / 1e6
    click.echo(
        printable(
            f"{mcap}: {found.flight.elapsed_s:.1f} s of flight, {written.messages} messages, "
            f"{written.pictures} pictures, {megabytes:.1f} MB"
        )
    )


def _place(found: NamedFlight) -> Place | None:
    from pytest_garl.reports.mcap.source import Place
    from pytest_garl.scenarios.placement import map_in

    if found.scenario is None or found.map is None:
        return None
    return Place(
        scenario=found.scenario, map=map_in(found.scenario, found.map), camera=found.camera
    )
