"""The terminal: header, live progress line and summary."""

from __future__ import annotations

import shutil
import time
from collections import Counter
from typing import Any, TextIO

from pytest_garl.run import Run
from pytest_garl.search.slots import Slot
from pytest_garl.verdicts.metrics import share_interval, top_k
from pytest_garl.verdicts.serialise import from_dict
from pytest_garl.verdicts.verdict import Verdict

REFRESH_S = 0.2


def header(run: Run) -> str:
    """Return the header line: what is searched, and how long it will probably take."""
    options = run.options
    if options.repeat:
        return f"garl: repeating {options.repeat}"
    each = options.budget * run.flight_s / max(1, options.workers)
    return (
        f"garl: budget {options.budget} per system and map, method {options.method}, "
        f"seed {options.seed}, objects {options.npcs}, weather {options.weather}, "
        f"{options.workers} workers; about {_duration(each)} per system and map"
    )


class Progress:
    """One line below the dots while the session waits for a flight."""

    def __init__(self, run: Run, file: TextIO) -> None:
        self._run, self._file = run, file
        self._began = self._last = time.monotonic()

    def __call__(self) -> None:
        """Redraw the line if it is old."""
        now = time.monotonic()
        if now - self._last < REFRESH_S:
            return
        self._last = now
        line = self._line(now)[: shutil.get_terminal_size().columns - 1]
        # Make room below without leaving the column, save the place, write, come back.
        self._file.write(f"\x1bD\x1bM\x1b7\r\n\x1b[2K{line}\x1b8")
        self._file.flush()

    def clear(self) -> None:
        """Remove the line."""
        self._file.write("\x1bD\x1bM\x1b7\r\n\x1b[2K\x1b8")
        self._file.flush()

    def _line(self, now: float) -> str:
        searches = self._run.ledger.progress()
        flown, total = sum(s[2] for s in searches), sum(s[3] for s in searches)
        rate = flown / max(1e-3, now - self._began)
        left = _duration((total - flown) / rate) if flown else "?"
        types = Counter(
            result["verdict"]["violation_type"]
            for *_, result in self._run.ledger.results()
            if result["verdict"]["violation_type"]
        )
        now_flying = next((s for s in searches if s[2] < s[3]), None)
        what = (
            f"{now_flying[0].split(':')[-1]} {now_flying[1]} {now_flying[2]}/{now_flying[3]}"
            if now_flying
            else ""
        )
        kinds = " ".join(f"{kind}:{count}" for kind, count in sorted(types.items()))
        return f"  {what}  all {flown}/{total}  {kinds}  {rate:.2f} flights/s  {left} left"


def summary(reporter: Any, run: Run) -> None:
    """Write a table per system and map, then what was found."""
    groups: dict[tuple[str, str], list[tuple[Slot, dict[str, Any]]]] = {}
    for system, map, generation, index, result in run.ledger.results():
        slot = Slot(generation=generation, index=index)
        groups.setdefault((system, map), []).append((slot, result))
    if not groups:
        return
    reporter.section("garl: violations", sep="=")
    for (system, map), flown in groups.items():
        _table(reporter, system, map, flown)
    reporter.write_line(f"ledger: {run.ledger.path}  results {run.ledger.result_hash()[:16]}")


def _table(reporter: Any, system: str, map: str, flown: list[tuple[Slot, dict[str, Any]]]) -> None:
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
        reporter.write_line(f"  {len(cases):4d}  {signature:<40}  --garl-repeat={first}")


def _percent(count: int, total: int) -> str:
    return f"{100 * count / total:.1f} %"


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"
