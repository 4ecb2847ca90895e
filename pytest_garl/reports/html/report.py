"""Write the report of a run as a folder of pages, with its flights from their records."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.errors import GarlError
from pytest_garl.reports.film.encoder import find_ffmpeg
from pytest_garl.reports.html import MOST_FILMS
from pytest_garl.reports.html.flight_task import ShownFlight
from pytest_garl.reports.html.folder import check_target, new_folder
from pytest_garl.reports.html.kind_page import KindPlan, found_page, kind_page, plan_kinds
from pytest_garl.reports.html.naming import INDEX, still_address
from pytest_garl.reports.html.page_workers import cores, shown_flights
from pytest_garl.reports.html.pictures import picture_bytes
from pytest_garl.reports.html.rendering import render_comparison, render_index, render_kind
from pytest_garl.reports.html.run_page import RunPage, run_page
from pytest_garl.reports.run_comparison import RunComparison
from pytest_garl.reports.run_record import RunRecord


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenReport:
    """A report that was written: its index, its pages, and what is missing in it.

    ``page`` is what the index says.
    """

    index: Path
    page: RunPage
    pages: int
    films: int
    notes: tuple[str, ...]


def write_html_report(
    run: RunRecord,
    out: Path,
    *,
    films: int = MOST_FILMS,
    workers: int | None = None,
    on_done: Callable[[int], None] = lambda done: None,
) -> WrittenReport:
    """Write the report of a run into the folder ``out``, whole or not at all.

    ``films`` kinds have a film, the most frequent ones, if there is an encoder; ``workers``
    processes draw, by default one per core.  Raises SavingError if ``out`` cannot be written or
    holds anything but a report.
    """
    check_target(out)
    no_encoder = _no_encoder() if films else ""
    plans = plan_kinds(run, 0 if no_encoder else films)
    tasks = [task for plan in plans for task in (plan.task, plan.found) if task is not None]
    flights = iter(shown_flights(tasks, workers or cores(), on_done))
    shown = [(plan, next(flights), next(flights) if plan.found else None) for plan in plans]
    notes = _notes([flight for _, *both in shown for flight in both if flight], no_encoder, plans)
    with new_folder(out) as folder:
        pages = []
        for plan, flight, as_found in shown:
            page = kind_page(plan, flight)
            pages.append((plan, page))
            _write(folder / page.address, render_kind(page))
            for still in (each for each in flight.stills if each.shows_cause):
                (folder / still_address(page.name)).write_bytes(picture_bytes(still.picture))
            if as_found is not None:
                other = found_page(plan, as_found)
                _write(folder / other.address, render_kind(other))
        index = run_page(run, pages, notes)
        _write(folder / INDEX, render_index(index))
    return WrittenReport(
        index=out / INDEX,
        page=index,
        pages=len(tasks),
        films=sum(bool(flight.film) for _, flight, _ in shown),
        notes=notes,
    )


def write_comparison(found: RunComparison, out: Path) -> Path:
    """Write two runs side by side into the folder ``out``, whole or not at all; return the page."""
    with new_folder(out) as folder:
        _write(folder / INDEX, render_comparison(found))
    return out / INDEX


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="")


def _no_encoder() -> str:
    """Return why there is no encoder; empty if there is one."""
    try:
        find_ffmpeg()
    except GarlError as error:
        return str(error)
    return ""


def _notes(
    flights: Sequence[ShownFlight], no_encoder: str, plans: Sequence[KindPlan]
) -> tuple[str, ...]:
    """Return what is missing in the report, in one line each."""
    missing = [flight.missing for flight in flights if flight.missing]
    notes = []
    if missing:
        notes.append(
            f"{len(missing)} of {len(flights)} flights have no record, so their pages have no path "
            f"and no pictures. The first: {missing[0]}"
        )
    if no_encoder and plans:
        notes.append(f"There are no films: {no_encoder}")
    return tuple(notes)
