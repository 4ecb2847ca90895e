"""The terminal: header and summary."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

import pytest

from pytest_garl import cpu_dispatch
from pytest_garl.plugin.github_summary import write_summary
from pytest_garl.plugin.keys import CASE, MAYBE_FIXED, OWN_FAILURE, STALE
from pytest_garl.plugin.progress import duration
from pytest_garl.plugin.run import Run
from pytest_garl.plugin.save_cases import told
from pytest_garl.plugin.session_status import notes
from pytest_garl.plugin.suggested_commands import repeat_command, shown
from pytest_garl.plugin.tally import Tally
from pytest_garl.plugin.wrapping import counted, width_of, wrapped
from pytest_garl.regressions.forecast import seconds_of_kind
from pytest_garl.reports.run_report import ENDED, OWN_FACT, utc
from pytest_garl.reports.violation_kinds import Found, Kind, Own, found_by, legend
from pytest_garl.verdicts.paper_metrics import top_k
from pytest_garl.verdicts.statistics import share_interval
from pytest_garl.verdicts.wording import decided_text


def header(run: Run) -> str:
    """Return the header line: what is searched, and how long it will probably take."""
    return "\n".join([_header(run), *_computed_otherwise(run)])


def _header(run: Run) -> str:
    options = run.options
    if options.repeat:
        return f"garl: repeating {options.repeat}"
    done = sum(search.flown for search in run.ledger.queries.progress()) if options.resume else 0
    before = f"resuming after {done} flights; " if options.resume else ""
    return (
        f"garl: {before}budget {options.budget} per system and map, method {options.method}, "
        f"seed {options.seed}, objects {options.npcs}, weather {options.weather}, "
        f"{_workers(run)}"
    )


def _computed_otherwise(run: Run) -> list[str]:
    """Say what it means that a library was loaded before its instructions could be chosen."""
    wrong, options = cpu_dispatch.disobeying(), run.options
    means = []
    if options.workers == 0:
        means.append("flown in a worker process, not inside pytest")
    if options.searches:
        means.append("what is bred here may differ from what another make of CPU breeds")
    if not wrong or not means:
        return []
    found = f"loaded before pytest-garl could choose its instructions: {', '.join(wrong)}"
    return ["; ".join([f"garl: {found}", *means])]


def _workers(run: Run) -> str:
    """Return how many fly and where, and how long it will take where that is known."""
    options = run.options
    ray = f" of Ray at {options.ray_address}" if options.ray_address else " of Ray, started here"
    place = ray if options.pool == "ray" else ""
    if options.workers is None:
        return f"all workers{place}"
    workers = counted(options.workers, "worker") if options.workers else "flown inside pytest"
    return f"{workers}{place}; {_times(run, options.budget)} per system and map{_per_kind(run)}"


def _times(run: Run, flights: int) -> str:
    return f"about {duration(flights * run.flight_s / max(1, run.options.workers or 1))}"


def _per_kind(run: Run) -> str:
    if not run.options.shrink:
        return ""
    seconds = seconds_of_kind(run.options.shrink, run.flight_s, run.options.workers or 1)
    return f", then about {duration(seconds)} per new kind of violation"


def forecast(run: Run) -> list[str]:
    """Say how long all searches take together, if there are several."""
    options = run.options
    sizes = [
        len(wanted)
        for wanted in run.targets.values()
        if all(target.entry is None for target in wanted.values())
    ]
    if not options.budget or options.workers is None or len(sizes) < 2:
        return []
    return [f"garl: {len(sizes)} searches, {_times(run, sum(sizes))}{_per_kind(run)}"]


def summary(reporter: Any, run: Run) -> None:
    """Write a table per system and map, then what was saved, and which cases may be fixed."""
    fold_skips(reporter)
    _searches(reporter, run)
    lines = [
        *told(run.pursued, reporter.config),
        *([f"nothing more was saved: {run.save_problem}"] if run.save_problem else []),
        *_maybe_fixed(reporter),
        *(wrapped(line, width_of(reporter.config)) for line in _computed_otherwise(run)),
    ]
    if lines:
        reporter.section("garl: cases", sep="=")
    for line in lines:
        reporter.write_line(line)


def colour(reporter: Any, tally: Tally) -> None:
    """Write why the session fails beside its items, or what its colour leaves open."""
    width = width_of(reporter.config)
    if tally.problems:
        reporter.section("garl: this run is not green", sep="=", red=True)
    for problem in tally.problems:
        reporter.write_line(wrapped(problem, width, others="  "), red=True)
    if not tally.problems:
        for note in notes(tally):
            reporter.write_line(wrapped(f"garl: {note}", width, others="  "), yellow=True)


def _maybe_fixed(reporter: Any) -> list[str]:
    """Return a line for each open case of which some test passed and none failed."""
    fixed = _told(reporter, ("passed",), MAYBE_FIXED) - _told(reporter, ("failed", "xfailed"), CASE)
    stale = _told(reporter, ("passed",), STALE)
    return [
        *(
            f"maybe fixed: {file} passes; if it is fixed:\n    garl cases promote {file}"
            for file in sorted(fixed)
        ),
        *(f"stale: {told}" for told in sorted(stale)),
    ]


def _told(reporter: Any, outcomes: tuple[str, ...], key: str) -> set[str]:
    """Return the values of a user property in reports."""
    reports = [report for outcome in outcomes for report in reporter.getreports(outcome)]
    return {
        str(value) for report in reports for name, value in report.user_properties if name == key
    }


def _searches(reporter: Any, run: Run) -> None:
    own = own_failures(reporter)
    if run.options.searches:
        run.ledger.note_fact(OWN_FACT, [dataclasses.asdict(each) for each in own])
        run.ledger.note_fact(ENDED, utc())
    found = found_by(run.ledger, own)
    again = [[again_command(each, kind, reporter.config) for kind in each.kinds] for each in found]
    write_summary(reporter, found, again)
    if not found:
        return
    reporter.section("garl: violations", sep="=")
    width = width_of(reporter.config)
    for each in found:
        for line in _table(each, reporter.config, width):
            reporter.write_line(line)
    words = legend(kind for each in found for kind in each.kinds)
    if words:
        reporter.write_line(wrapped(words, width))
    reporter.write_line(wrapped(_spent(run), width))
    searches = run.ledger.queries.progress()
    done, total = sum(each.flown for each in searches), sum(each.all for each in searches)
    if done < total and not run.options.repeat:
        reporter.write_line(
            f"not finished: {done} of {total} flown; the same command with --garl-resume goes on"
        )
    reporter.write_line(
        f"ledger: {run.ledger.path}  results {run.ledger.queries.result_hash()[:16]}"
    )


def fold_skips(reporter: Any) -> None:
    """Make one line of all tests in a file that were not decided: each has a time of its own."""
    for report in reporter.stats.get("skipped", ()):
        if not isinstance(report.longrepr, tuple):
            continue
        reason = str(report.longrepr[2])
        if reason.startswith(_UNDECIDED):
            file = reporter.config.rootpath / report.nodeid.partition("::")[0]
            told = f"{_UNDECIDED} the flight ended before (-v tells how)"
            report.longrepr = (str(file), None, told)


_UNDECIDED = "Skipped: not decided:"


def own_failures(reporter: Any) -> list[Own]:
    """Return the tests' own assertions that failed, known and repeated ones among them."""
    found = []
    for report in [*reporter.getreports("failed"), *reporter.getreports("xfailed")]:
        told = dict(report.user_properties)
        if OWN_FAILURE in told:
            system, map, slot, signature, message = json.loads(str(told[OWN_FAILURE]))
            found.append(
                Own(system=system, map=map, slot=slot, signature=signature, message=message)
            )
    return found


def _table(found: Found, config: pytest.Config, width: int) -> list[str]:
    """Return a system's shares on a map, then its kinds of violation with how to see each."""
    total, verdicts = len(found.verdicts), found.verdicts
    low, high = share_interval(found.violating, total)
    paper = sum(verdict.paper_violation for verdict in verdicts)
    shares = [
        f"{total} flown",
        f"violations {_percent(found.violating, total)} [{100 * low:.1f}, {100 * high:.1f}]",
    ]
    if paper != found.violating:
        shares.append(f"by the paper's definition {_percent(paper, total)}")
    shares += [
        f"landed {_percent(found.count('landed'), total)}",
        f"gave up {_percent(found.count('aborted'), total)}",
    ]
    late = sum(verdict.violation_type == "late" for verdict in verdicts)
    rare = {"late": late, **found.crashes}
    shares += [f"{word} {_percent(count, total)}" for word, count in rare.items() if count]
    if unsure := found.count("inconclusive"):
        shares.append(f"inconclusive {unsure}")
    if tenth := top_k(verdicts):
        shares.append(f"the tenth violation in flight {tenth}")
    lines = [
        wrapped(f"{found.name} on {found.map}: {', '.join(shares)}", width, others="  "),
        wrapped(decided_text(verdicts), width, first="  ", others="  "),
    ]
    longest = max((len(kind.signature) for kind in found.kinds), default=0)
    for kind in found.kinds:
        head = f"  {kind.count:4d}  {kind.signature:<{longest}}"
        again = again_command(found, kind, config)
        fits = len(head) + 2 + len(again) <= width
        lines += [f"{head}  {again}"] if fits else [head.rstrip(), f"{'':8}{again}"]
        lines.append(wrapped(kind.headline, width, first=" " * 8, others=" " * 8))
    return lines


def again_command(found: Found, kind: Kind, config: pytest.Config) -> str:
    """Return the command that flies the first flight of a kind again."""
    files = " ".join(shown(config.rootpath / file, config) for file in found.files)
    return repeat_command(config, files, kind.first)


def _spent(run: Run) -> str:
    """Return what the run cost beside the budget."""
    meters = run.ledger.queries.meters()
    flying, idle = meters.get("flying_s", 0.0), meters.get("idle_s", 0.0)
    pursued = sum(each.result.flights for each in run.pursued)
    repeats = meters.get("on_demand", 0) - pursued
    counts = {
        "flown again after a time-out or a kill": meters.get("retried", 0),
        "to see whether violations repeat": max(0, repeats),
        "to confirm and shrink": pursued,
    }
    words = [f"flights: {meters.get('flights', 0):.0f}"]
    words += [f"{what} {count:.0f}" for what, count in counts.items() if count]
    if run.options.shrink == 0 and not run.options.repeat:
        words.append("nothing confirmed, shrunk or saved (--garl-shrink=0)")
    if flying + idle > 0:
        words.append(f"workers idle {100 * idle / (flying + idle):.0f} %")
    return ", ".join(words)


def _percent(count: int, total: int) -> str:
    return f"{100 * count / total:.1f} %"
