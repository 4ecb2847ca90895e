"""The terminal: header and summary."""

from __future__ import annotations

from typing import Any

from pytest_garl import dispatch
from pytest_garl.reports.aftermath import told
from pytest_garl.reports.explain import MAYBE_FIXED, STALE
from pytest_garl.reports.progress import duration
from pytest_garl.run import Run
from pytest_garl.search.slots import Slot
from pytest_garl.verdicts.metrics import share_interval, top_k
from pytest_garl.verdicts.serialise import from_dict
from pytest_garl.verdicts.verdict import Verdict


def header(run: Run) -> str:
    """Return the header line: what is searched, and how long it will probably take."""
    return "\n".join([_header(run), *_computed_otherwise(run)])


def _header(run: Run) -> str:
    options = run.options
    if options.repeat:
        return f"garl: repeating {options.repeat}"
    done = sum(search.flown for search in run.ledger.progress()) if options.resume else 0
    before = f"resuming after {done} flights; " if options.resume else ""
    return (
        f"garl: {before}budget {options.budget} per system and map, method {options.method}, "
        f"seed {options.seed}, objects {options.npcs}, weather {options.weather}, "
        f"{_workers(run)}"
    )


def _computed_otherwise(run: Run) -> list[str]:
    """Say what it means that a library was loaded before its instructions could be chosen."""
    wrong, options = dispatch.disobeying(), run.options
    means = []
    if options.workers == 0:
        means.append("flown in a child process, not inside pytest")
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
    each = options.budget * run.flight_s / max(1, options.workers)
    return f"{options.workers} workers{place}; about {duration(each)} per system and map"


def summary(reporter: Any, run: Run) -> None:
    """Write a table per system and map, then what was saved, and which cases may be fixed."""
    _searches(reporter, run)
    lines = [
        *told(run.pursued, run.options.root, reporter._tw.fullwidth),
        *_maybe_fixed(reporter),
        *_computed_otherwise(run),
    ]
    if lines:
        reporter.section("garl: cases", sep="=")
    for line in lines:
        reporter.write_line(line)


def _maybe_fixed(reporter: Any) -> list[str]:
    """Return a line for each open case that passed."""
    properties = [
        each for report in reporter.getreports("passed") for each in report.user_properties
    ]
    files = sorted({str(value) for key, value in properties if key == MAYBE_FIXED})
    stale = sorted({str(value) for key, value in properties if key == STALE})
    return [
        *(f"maybe fixed: {file} passes; if so: garl cases promote {file}" for file in files),
        *(f"stale: {told}" for told in stale),
    ]


def _searches(reporter: Any, run: Run) -> None:
    groups: dict[tuple[str, str], list[tuple[Slot, dict[str, Any]]]] = {}
    for system, map, generation, index, result in run.ledger.results():
        slot = Slot(generation=generation, index=index)
        groups.setdefault((system, map), []).append((slot, result))
    if not groups:
        return
    reporter.section("garl: violations", sep="=")
    for (system, map), flown in groups.items():
        files = run.ledger.fact(f"files of {system} on {map}") or ""
        _table(reporter, system, map, flown, files)
    reporter.write_line(_spent(run.ledger.meters()))
    searches = run.ledger.progress()
    done, total = sum(each.flown for each in searches), sum(each.all for each in searches)
    if done < total and not run.options.repeat:
        reporter.write_line(
            f"not finished: {done} of {total} flown; the same command with --garl-resume goes on"
        )
    reporter.write_line(f"ledger: {run.ledger.path}  results {run.ledger.result_hash()[:16]}")


def _table(
    reporter: Any, system: str, map: str, flown: list[tuple[Slot, dict[str, Any]]], files: str
) -> None:
    total = len(flown)
    verdicts = [from_dict(result["verdict"]) for _, result in flown]
    bad = sum(verdict.paper_violation for verdict in verdicts)
    low, high = share_interval(bad, total)
    late = sum(verdict.violation_type == "late" for verdict in verdicts)
    aborted = sum(verdict.outcome == "aborted" for verdict in verdicts)
    crashed = sum(verdict.violation_type == "V" for verdict in verdicts)
    unsure = sum(result["outcome"] == "inconclusive" for _, result in flown)
    tenth = top_k(verdicts)
    reporter.write_line(
        f"{system.split(':')[-1]} on {map}: {total} flown, violations {_percent(bad, total)} "
        f"[{100 * low:.1f}, {100 * high:.1f}], late {_percent(late, total)}, aborted "
        f"{_percent(aborted, total)}, crashed {_percent(crashed, total)}, inconclusive {unsure}, "
        f"Top-10 {tenth if tenth is not None else 'not reached'}"
    )
    found: dict[str, list[tuple[Slot, Verdict]]] = {}
    for (slot, _), verdict in zip(flown, verdicts, strict=True):
        if verdict.violation:
            found.setdefault(verdict.signature, []).append((slot, verdict))
    for signature, cases in sorted(found.items(), key=lambda item: (-len(item[1]), item[0])):
        first = cases[0][0].id(map)
        again = " ".join(filter(None, ["pytest", files, f"--garl-repeat={first}"]))
        reporter.write_line(f"  {len(cases):4d}  {signature:<32}  {again}")


def _spent(meters: dict[str, float]) -> str:
    """Return what the run cost beside the budget."""
    flying, idle = meters.get("flying_s", 0.0), meters.get("idle_s", 0.0)
    words = f"flights: {meters.get('flights', 0):.0f}, flown again {meters.get('retried', 0):.0f}"
    if "errands" in meters:
        words += f", to confirm and shrink {meters['errands']:.0f}"
    if flying + idle > 0:
        words += f", workers idle {100 * idle / (flying + idle):.0f} %"
    return words


def _percent(count: int, total: int) -> str:
    return f"{100 * count / total:.1f} %"
