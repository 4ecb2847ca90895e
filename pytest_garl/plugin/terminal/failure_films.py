"""Films of what failed in a run, drawn before the summary names them: ``--garl-film=failures``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pytest_garl.errors import GarlError
from pytest_garl.execution.flight_id import OF_CASE
from pytest_garl.messages import printable
from pytest_garl.plugin.items.item_record import records
from pytest_garl.plugin.items.suggested_commands import shown_path
from pytest_garl.plugin.session.run import FilmKey, Films, Run
from pytest_garl.plugin.terminal_text import (
    begin_line,
    counted,
    duration,
    listed,
    width_of,
    wrapped,
)

if TYPE_CHECKING:
    from pytest_garl.execution.ledger_queries import LedgerFlight
    from pytest_garl.plugin.session.tally import Tally
    from pytest_garl.reports.films import FilmTask

FILM_S = 6.0
"""Computing time of a film, as docs/html-report.md says."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Failure:
    """What failed, and the flight that shows it; ``name`` is that of its item."""

    key: FilmKey
    name: str
    flight: LedgerFlight


def draw_failures(reporter: Any, run: Run, tally: Tally) -> Films:
    """Draw the films of a run's failures, as far as that can be done."""
    if tally.interrupted:
        return Films(
            notes=("interrupted, so no film was drawn; `garl film SLOT` draws what was flown",)
        )
    try:
        return _drawn(reporter, run, [*_failed_cases(reporter, run), *_kinds(run, tally)])
    except (GarlError, OSError) as error:
        return Films(notes=(f"no film was drawn: {error}",))


def film_lines(films: Films, config: Any) -> list[str]:
    """Return the summary's lines about the films of saved cases, and what has none."""
    width = width_of(config)
    cases = [f"film of {name}: {shown_path(path, config)}" for name, path in films.of_cases.items()]
    return [*cases, *(wrapped(printable(note), width, others="  ") for note in films.notes)]


def _drawn(reporter: Any, run: Run, failures: Sequence[_Failure]) -> Films:
    from pytest_garl.reports.films import (
        FilmTask,
        draw_films,
        recorded_flight,
        why_no_film,
    )
    from pytest_garl.reports.html import MOST_FILMS
    from pytest_garl.reports.html.page_workers import cores

    shown, folder = failures[:MOST_FILMS], run.options.films
    tasks = {
        each.key: FilmTask(
            flight=recorded_flight(run.ledger, each.flight), file=folder / f"{name}.mp4"
        )
        for each, name in zip(shown, _names(shown), strict=True)
    }
    for earlier in folder.glob("*.mp4"):
        earlier.unlink()
    # Two kinds may have the same first flight.
    unique = {task.file: task for task in tasks.values()}.values()
    hopeless = [(task, why) for task in unique if (why := why_no_film(task.flight))]
    wanted = [task for task in unique if not why_no_film(task.flight)]
    workers = min(run.options.workers or cores(), cores(), len(wanted))
    notes = _missing(hopeless)
    try:
        if wanted:
            begin_line(reporter)
            takes = duration(FILM_S * len(wanted) / workers)
            films = counted(len(wanted), "film")
            reporter.write_line(f"garl: drawing {films} of what failed, about {takes}")
        notes += _missing(zip(wanted, draw_films(wanted, workers), strict=True))
    except KeyboardInterrupt:
        notes.append("interrupted while films were drawn; `garl film SLOT` draws the others")
    except GarlError as error:
        notes.append(f"not all films were drawn: {error}")
    files = {key: task.file for key, task in tasks.items() if task.file.is_file()}
    where = shown_path(folder, reporter.config)
    drawn = counted(len({*files.values()}), "film")
    told = (
        f"{drawn} of what failed in {where}" if failures else "nothing failed, so no film was drawn"
    )
    return Films(files=files, notes=(told, *notes, *_beyond(failures[MOST_FILMS:], MOST_FILMS)))


def _failed_cases(reporter: Any, run: Run) -> Iterator[_Failure]:
    """Yield the saved cases of which a test failed, in the order in which they failed."""
    seen = set()
    for record in records(reporter, "failed"):
        name = record.slot or ""
        if not name.startswith(OF_CASE) or name in seen:
            continue
        seen.add(name)
        sha256, signature = record.trajectory_sha256 or "", record.signature or ""
        flight = run.ledger.queries.flight_with_hash(sha256, signature=signature)
        if flight is not None:
            yield _Failure(key=(name,), name=name, flight=flight)


def _kinds(run: Run, tally: Tally) -> list[_Failure]:
    """Return the first flight of each kind of violation, the most frequent kinds first."""
    found = [
        (-kind.count, index, _Failure(key=key, name=kind.first, flight=search.by_slot[kind.first]))
        for index, search in enumerate(tally.run_record(run).searches)
        for kind in search.kinds
        for key in [(search.name, kind.signature)]
    ]
    return [failure for *_, failure in sorted(found, key=lambda each: each[:2])]


def _names(failures: Sequence[_Failure]) -> list[str]:
    """Return the names of the films: `garl film` takes each of them for its flight.

    A slot that two landing systems flew has the digits of its search before it.
    """
    flights = Counter(name for name, _ in {(each.name, each.flight.id) for each in failures})
    return [each.flight.id.name if flights[each.name] > 1 else each.name for each in failures]


def _missing(found: Iterable[tuple[FilmTask, str]]) -> list[str]:
    """Return why some films are missing, each reason once; an empty one is none."""
    reasons: dict[str, list[str]] = {}
    for task, problem in found:
        if problem:
            reasons.setdefault(problem, []).append(task.file.stem)
    return [f"no film of {listed(names)}: {reason}" for reason, names in reasons.items()]


def _beyond(failures: Sequence[_Failure], most: int) -> list[str]:
    if not failures:
        return []
    names = listed([each.name for each in failures])
    return [f"{most} films are drawn at most; `garl film SLOT` draws the others: {names}"]
