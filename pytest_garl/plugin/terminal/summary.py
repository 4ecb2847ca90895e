"""The terminal summary: what was found and saved, and why a session is not green."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from pytest_garl.cases.reference_proofs import renewal_line
from pytest_garl.messages import command
from pytest_garl.plugin.items.item_record import records
from pytest_garl.plugin.items.outcomes import NOT_JUDGED
from pytest_garl.plugin.items.suggested_commands import repeat_files_command, shown_path
from pytest_garl.plugin.options import Options
from pytest_garl.plugin.session.run import FilmKey, Films, Run
from pytest_garl.plugin.session.session_status import notes
from pytest_garl.plugin.session.tally import Tally
from pytest_garl.plugin.terminal.failure_films import film_lines
from pytest_garl.plugin.terminal.header import cpu_dispatch_warning
from pytest_garl.plugin.terminal.save_cases import saved_lines
from pytest_garl.plugin.terminal_text import counted, width_of, wrapped
from pytest_garl.reports.run_record import WHY_NO_LANDING, KindRecord, RunRecord, SearchRecord
from pytest_garl.reports.run_text import (
    PAPER_DEFINITION,
    RepeatCommand,
    legend_of,
    percent,
)
from pytest_garl.search.method_catalogue import remembers
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS
from pytest_garl.verdicts.wording import limits_text

NO_FILMS: Mapping[FilmKey, str] = MappingProxyType({})
_SKIPPED = f"Skipped: {NOT_JUDGED}:"
"""Begins pytest's reason for a test that its flight does not judge."""


def write_run(reporter: Any, run: Run, tally: Tally) -> None:
    """Write a table for each search, then the saved cases, and those that may be fixed."""
    fold_skips(reporter)
    record = tally.run_record(run)
    if record.searches:
        reporter.section("garl: violations", sep="=")
        for line in _lines_about(record, run, tally, reporter):
            reporter.write_line(line)
    lines = [
        *_excused_lines(tally, width_of(reporter.config)),
        *saved_lines(run, reporter.config),
        *([f"nothing more was saved: {run.save_problem}"] if run.save_problem else []),
        *_passing_cases(reporter),
        *renewal_lines(reporter),
        *_cases_outside(reporter),
        *(wrapped(line, width_of(reporter.config)) for line in cpu_dispatch_warning(run)),
    ]
    films = film_lines(run.films, reporter.config) if run.films else []
    for title, text in (("cases", lines), ("films", films)):
        if text:
            reporter.section(f"garl: {title}", sep="=")
        for line in text:
            reporter.write_line(line)


def write_status(reporter: Any, tally: Tally) -> None:
    """Write why the session fails although no item does, or what a green session leaves open."""
    width = width_of(reporter.config)
    if tally.problems:
        reporter.section("garl: this run is not green", sep="=", red=True)
    for problem in tally.problems:
        reporter.write_line(wrapped(problem, width, others="  "), red=True)
    if not tally.problems:
        for note in notes(tally):
            reporter.write_line(wrapped(f"garl: {note}", width, others="  "), yellow=True)


def _excused_lines(tally: Tally, width: int) -> list[str]:
    """Return a line for each kind that a known case excuses, with the file of the case."""
    slots: dict[tuple[str, ...], set[str]] = {}
    for each in tally.records:
        if each.excused_by:
            place, ending = (each.system, each.map), each.failure_signature
            kind = (*place, tally.search_name(each), ending, each.excused_by)
            slots.setdefault(kind, set()).add(each.slot or "")
    return [
        wrapped(
            f"known: {name}: {ending} in {counted(len(found), 'flight')}, excused by {file}",
            width,
            others="    ",
        )
        for (_, _, name, ending, file), found in sorted(slots.items())
    ]


def _passing_cases(reporter: Any) -> list[str]:
    """Return a line for each open case of which some test passed and none failed."""
    failing = {each.failing_case for each in records(reporter, "failed", "xfailed")}
    passing = [*records(reporter, "passed")]
    fixed = {each.maybe_fixed for each in passing} - {"", *failing}
    stale = {each.stale for each in passing} - {""}
    elsewhere = {each.passes_elsewhere for each in passing} - {""}
    promote = {file: command("garl", "cases", "promote", file) for file in sorted(fixed)}
    return [
        *(
            f"maybe fixed: {file} passes; if it is fixed:\n    {text}"
            for file, text in promote.items()
        ),
        *(f"stale: {text}" for text in sorted(stale)),
        *(f"passes on another engine: {text}" for text in sorted(elsewhere)),
    ]


def renewal_lines(reporter: Any) -> list[str]:
    """Return the line that tells of cases with another version's hash that fly as recorded."""
    reported = records(reporter, "passed", "failed", "xfailed", "skipped", "error")
    line = renewal_line(len({each.renewable for each in reported} - {""}))
    return [line] if line else []


def _cases_outside(reporter: Any) -> list[str]:
    """Return a line for each case whose values lie outside the domain of its test."""
    reported = records(reporter, "passed", "failed", "xfailed", "skipped")
    outside = {each.outside for each in reported} - {""}
    width = width_of(reporter.config)
    return [wrapped(f"flown, although {text}", width, others="  ") for text in sorted(outside)]


def _lines_about(record: RunRecord, run: Run, tally: Tally, reporter: Any) -> list[str]:
    width, config, films = width_of(reporter.config), reporter.config, run.films or Films()
    repeat = functools.partial(repeat_files_command, config)
    shown = {key: shown_path(film, config) for key, film in films.files.items()}
    types = legend((*record.kinds, *(finding for _, finding in record.findings)))
    costs = _costs(record, run.options)
    unfinished = _not_finished(record, run, tally)
    worlds = dict.fromkeys(
        f"domain {search.key.domain}, NPCs {' and '.join(search.npcs)}"
        for search in record.searches
        if search.key.domain
    )
    tables = [line for each in record.searches for line in search_table(each, repeat, width, shown)]
    return [
        *(wrapped(text, width, others="  ") for text in archive_lines(run)),
        *tables,
        *(wrapped(text, width) for text in (types, costs) if text),
        *unfinished,
        *(wrapped(world, width, others="  ") for world in worlds),
        f"ledger: {record.ledger}  results {record.results_sha256[:16]}",
    ]


def archive_lines(run: Run) -> list[str]:
    """Return what the searches began with and what they left, if an ini key names an archive."""
    options, facts = run.options, run.ledger.facts
    if options.archive is None or options.repeat:
        return []
    if facts.archive is None:
        return [f"archive: none when the search began, which is written to {options.archive.name}"]
    if not remembers(options.method):
        return [f"archive: {facts.archive}, which the method {options.method} does not use"]
    known, suspects = facts.knowledge
    again = f", {suspects} to fly again that failed in other searches" if suspects else ""
    return [f"archive: {facts.archive}, {known} flights known{again}"]


def legend(kinds: Iterable[KindRecord]) -> str:
    """Return the meanings of the types of these kinds, in one line."""
    kinds = tuple(kinds)
    types, meanings = {kind.type for kind in kinds}, legend_of(kind.signature for kind in kinds)
    return "; ".join(f"{name}: {meaning}" for name, meaning in meanings.items() if name in types)


def _not_finished(record: RunRecord, run: Run, tally: Tally) -> list[str]:
    """Return a line with the way to continue, if the search or its shrinking was interrupted."""
    if run.options.repeat:
        return []
    goes_on = "the same command with --garl-resume goes on"
    if record.flown < record.wanted:
        return [f"not finished: {record.flown} of {record.wanted} flown; {goes_on}"]
    if tally.interrupted and run.investigations is not None:
        return [f"not finished: all {record.wanted} flown, but not all is shrunk; {goes_on}"]
    return []


def fold_skips(reporter: Any) -> None:
    """Give one reason to the tests of a file that are not judged: pytest writes them in one line.

    Each reason holds a time of its own, by which pytest would keep them apart.
    """
    for report in reporter.stats.get("skipped", ()):
        if not isinstance(report.longrepr, tuple):
            continue
        reason = str(report.longrepr[2])
        if reason.startswith(_SKIPPED):
            file = reporter.config.rootpath / report.nodeid.partition("::")[0]
            folded = f"{_SKIPPED} the flight ended before, or another test fails (-v: which)"
            report.longrepr = (str(file), None, folded)


def _costs(record: RunRecord, options: Options) -> str:
    """Return how many flights the run needed beside the budget, and how busy its workers were."""
    costs = record.costs
    counts = {
        "flown again after a time-out or a kill": costs.flown_again,
        "to see whether violations repeat": costs.repeating,
        "to tell causes of one ending apart": costs.twins,
        "to confirm and shrink": costs.confirming,
    }
    words = [f"flights: {costs.flights}"]
    words += [f"{purpose} {count}" for purpose, count in counts.items() if count]
    if options.shrink == 0 and not options.repeat:
        words.append("nothing confirmed, shrunk or saved (--garl-shrink=0)")
    if costs.idle_share is not None:
        words.append(f"workers idle {100 * costs.idle_share:.0f} %")
    return ", ".join(words)


def search_table(
    search: SearchRecord,
    repeat: RepeatCommand,
    width: int,
    films: Mapping[FilmKey, str] = NO_FILMS,
) -> list[str]:
    """Return the shares of a search, then each kind of violation and how to see it.

    What else was noted follows; no item fails for it.
    """
    lines = [
        wrapped(f"{search.name}: {headline_shares(search)}", width, others="  "),
        *(
            wrapped(line, width, first="  ", others="    ")
            for line in (*share_lines(search), *search.remarks)
        ),
    ]
    noted = ["  also noted, no test fails for it:"] if search.findings else []
    for title, kinds, shown in (([], search.kinds, films), (noted, search.findings, NO_FILMS)):
        lines += [*title, *_kind_lines(search, kinds, repeat, width, shown)]
    return lines


def headline_shares(search: SearchRecord) -> str:
    """Return such as ``60 flown, landed 55 %, violations 40 % [28, 54]``."""
    total = search.flown
    low, high = (percent(total * each, total, sign="") for each in search.violating_interval)
    shares = [f"{total} flown", f"landed {percent(search.landed, total)}"]
    if search.completed != search.landed:
        shares.append(f"within the limit of distance {percent(search.completed, total)}")
    violations = percent(search.violating, total)
    return ", ".join([*shares, f"violations {violations} [{low}, {high}]"])


def share_lines(search: SearchRecord) -> list[str]:
    """Return the other shares: the paper's definition, no landing, crashes, figures, limits."""
    paper = percent(search.violating_by_the_paper, search.flown)
    tenth = search.tenth_violation
    found = f", the tenth in flight {tenth}" if tenth else ""
    return [
        f"{PAPER_DEFINITION}: violations {paper}{found}",
        _no_landing(search),
        _landings(search),
        f"distance decided in {search.decided['distance']} of {search.flown} flights, "
        f"time in {search.decided['time']}",
        *(f"limits: {limits_text(each)}" for each in search.limits if each != DEFAULT_LIMITS),
    ]


def _no_landing(search: SearchRecord) -> str:
    """Return the flights that gave up and those without landing, by reason, and the crashes."""
    total, gave_up, not_landed = search.flown, search.gave_up, search.not_landed
    shares = [f"{reason} {percent(gave_up[reason], total)}" for reason in WHY_NO_LANDING]
    parts = [f"gave up: {', '.join(shares)}"]
    forced = [f"{why} {not_landed[why]}" for why in WHY_NO_LANDING[1:] if not_landed[why]]
    reasons = f" (of them {', '.join(forced)})" if forced else ""
    parts.append(f"not landed {percent(sum(not_landed.values()), total)}{reasons}")
    parts += [f"{kind} {percent(count, total)}" for kind, count in search.crashes.items()]
    if search.inconclusive:
        parts.append(f"inconclusive {len(search.inconclusive)}")
    return "; ".join(parts)


def _landings(search: SearchRecord) -> str:
    """Return the median and the worst figures of the flights that landed, or that none did."""
    distance_m, time_s = search.landing_distance_m, search.landing_time_s
    if search.held:
        held = counted(search.held, "flight")
        return f"held its place in {held}: no landing, its plans are judged"
    if distance_m is None or time_s is None:
        return "landed 0 %: no flight landed, so nothing is known of its landings"
    return (
        f"landings: distance median {distance_m.median:.2f} m, worst {distance_m.worst:.2f} m; "
        f"time median {time_s.median:.1f} s, worst {time_s.worst:.1f} s"
    )


def _kind_lines(
    search: SearchRecord,
    kinds: Sequence[KindRecord],
    repeat: RepeatCommand,
    width: int,
    films: Mapping[FilmKey, str],
) -> list[str]:
    lines = []
    longest = max((len(kind.signature) for kind in kinds), default=0)
    for kind in kinds:
        signature = f"  {kind.count:4d}  {kind.signature:<{longest}}"
        command = repeat(search.key.files, kind.first)
        fits = len(signature) + 2 + len(command) <= width
        lines += [f"{signature}  {command}"] if fits else [signature.rstrip(), f"{'':8}{command}"]
        for text in filter(None, (kind.title, kind.headline)):
            lines.append(wrapped(text, width, first=" " * 8, others=" " * 8))
        facts = "; ".join(filter(None, (kind.least, kind.seen_in_control)))
        if facts:
            lines.append(wrapped(facts, width, first=" " * 8, others=" " * 10))
        if film := films.get((search.name, kind.signature)):
            lines.append(f"{'':8}film: {film}")
    return lines
