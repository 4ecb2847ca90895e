"""``garl film``: draw any flight as a film: of a run, of a saved case, or of a flight's file."""

from __future__ import annotations

import re
from pathlib import Path

import click

from pytest_garl.cli.cases import FOLDER, say
from pytest_garl.errors import GarlError
from pytest_garl.execution.flight_id import FIRST_SLOT
from pytest_garl.files.toml import Table, parse
from pytest_garl.messages import shortened
from pytest_garl.regressions.corpus import Corpus
from pytest_garl.simulation.flight import Flight
from pytest_garl.video.film_file import check_film_file

LEDGER = Path(".garl/ledger.sqlite")
SLOT = re.compile(r"(?:[0-9a-f]{8}-)?.+-g\d{2,}-s\d{2,}")
"""A slot as pytest prints it, and with the first digits of its search's key before it."""
CASE_PREFIX = "case-"
"""Begins the names of saved cases that pytest prints."""


@click.command()
@click.argument("flight", metavar="SLOT|CASE|FILE")
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
@click.option(
    "--ledger",
    type=click.Path(path_type=Path, dir_okay=False),
    help=f"Ledger of the run.  [default: {LEDGER}]",
)
@click.option(
    "--scenario",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="Scenario that was flown, or its case: for a flight's file that no ledger knows.",
)
@click.option(
    "--system",
    metavar="MODULE:CLASS",
    help="Landing system that flew it, for its camera: for a flight's file that no ledger knows.",
)
@FOLDER
def film(
    flight: str,
    out: Path | None,
    last_s: float | None,
    ledger: Path | None,
    scenario: Path | None,
    system: str | None,
    folder: Path,
) -> None:
    """Draw a flight as a film (needs ffmpeg, or the extra: video).

    SLOT is a slot of the last run, such as court-g03-s17. Its film is drawn from the flight's
    record.

    CASE is a saved case: its name, or its .toml file. Its film is drawn from the record if the
    ledger has its flight; if not, the case is flown again. Nobody judges it.

    FILE is a flight's record (.npz). The ledger tells its scenario and its camera; without one give
    --scenario and --system.
    """
    file = Path(flight)
    if file.suffix != ".npz" and (scenario is not None or system is not None):
        raise GarlError(
            "--scenario and --system have no effect here: they say what was flown in a flight's "
            "file (.npz); a slot and a case know it"
        )
    name = file.stem if file.suffix in (".npz", ".toml") else file.name
    path = out or Path(f"{name}.mp4")
    check_film_file(path)
    from pytest_garl.cli.film_sources import Film

    drawn = Film(path=path, last_s=last_s, ledger=ledger or LEDGER, ledger_given=ledger is not None)
    corpus = Corpus(folder, (Path.cwd() / "scenarios" / "maps",))
    if file.suffix == ".npz":
        how, shown = drawn.of_file(file, scenario, system)
    elif file.suffix == ".toml":
        how, shown = drawn.of_case(_case_file(file))
    elif SLOT.fullmatch(flight):
        how, shown = drawn.of_slot(flight)
    else:
        live = flight.startswith(CASE_PREFIX) and flight.endswith("-live")
        how, shown = drawn.of_case(_case_named(flight.removesuffix("-live"), corpus), live=live)
    say(_told(path, shown, last_s, how))


def _told(path: Path, flight: Flight, last_s: float | None, how: str) -> str:
    seconds = min(flight.elapsed_s, last_s or flight.elapsed_s)
    part = "the last " if last_s and last_s < flight.elapsed_s else ""
    return f"{path}: {part}{seconds:.1f} s, {path.stat().st_size / 1e6:.1f} MB, {how}"


def _case_file(file: Path) -> Path:
    """Return the file if it is a case; raise GarlError if it is none, or a scenario."""
    if not file.is_file():
        raise GarlError(
            f"{file}: found nothing, expected a saved case; `garl cases list` lists them"
        )
    from pytest_garl.files.reading import read_text

    values = Table(parse(read_text(file), str(file)), str(file)).values
    if "evidence" not in values:
        slot = FIRST_SLOT.id(shortened(str(values.get("map", "MAP"))))
        raise GarlError(
            f"{file}: found no evidence of a flight, expected a saved case. If it is a scenario, "
            f"fly it first: pytest --garl-repeat={file}, then garl film {slot} "
            f"--ledger={LEDGER.with_name('repeat.sqlite')}"
        )
    return file


def _case_named(name: str, corpus: Corpus) -> Path:
    """Return the file of the case with this name, as pytest or ``garl cases list`` prints it."""
    wanted = name.removeprefix(CASE_PREFIX).rpartition("/")[2]
    entries = corpus.all_entries()
    found = [entry.path for entry in entries if entry.name == wanted]
    if len(found) == 1:
        return found[0]
    if found:
        files = "\n".join(f"    garl film {path}" for path in found)
        raise GarlError(f"{name}: {len(found)} cases have this name; give a file:\n{files}")
    from difflib import get_close_matches

    near = get_close_matches(wanted, [entry.name for entry in entries], n=3)
    hint = f"; did you mean {' or '.join(near)}?" if near else "; `garl cases list` lists the cases"
    raise GarlError(
        f"{name}: found neither a slot such as court-g03-s17, nor a case of this name in "
        f"{corpus.folder}, nor a file .toml or .npz{hint}"
    )
