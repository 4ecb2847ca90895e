"""The lines of a summary about one search: its shares, then its kinds of violation."""

from __future__ import annotations

import pytest

from pytest_garl.plugin.suggested_commands import repeat_command, shown_path
from pytest_garl.plugin.terminal_text import wrapped
from pytest_garl.reports.search_summary import SearchSummary, ViolationKind
from pytest_garl.verdicts.paper_metrics import top_k
from pytest_garl.verdicts.statistics import share_interval
from pytest_garl.verdicts.wording import decided_text


def search_table(search: SearchSummary, config: pytest.Config, width: int) -> list[str]:
    """Return the shares of a system on a map, then each kind of violation and how to see it."""
    lines = [
        wrapped(f"{search.name} on {search.map}: {', '.join(_shares(search))}", width, others="  "),
        wrapped(decided_text(search.verdicts), width, first="  ", others="  "),
    ]
    longest = max((len(kind.signature) for kind in search.kinds), default=0)
    for kind in search.kinds:
        signature = f"  {kind.count:4d}  {kind.signature:<{longest}}"
        command = repeat_kind_command(search, kind, config)
        fits = len(signature) + 2 + len(command) <= width
        lines += [f"{signature}  {command}"] if fits else [signature.rstrip(), f"{'':8}{command}"]
        lines.append(wrapped(kind.headline, width, first=" " * 8, others=" " * 8))
    return lines


def repeat_kind_command(search: SearchSummary, kind: ViolationKind, config: pytest.Config) -> str:
    """Return the command that repeats the first flight of a kind."""
    files = " ".join(shown_path(config.rootpath / file, config) for file in search.files)
    return repeat_command(config, files, kind.first)


def _shares(search: SearchSummary) -> list[str]:
    total, verdicts = len(search.verdicts), search.verdicts
    low, high = share_interval(search.violating, total)
    shares = [
        f"{total} flown",
        f"violations {_percent(search.violating, total)} [{100 * low:.1f}, {100 * high:.1f}]",
    ]
    paper = sum(verdict.paper_violation for verdict in verdicts)
    if paper != search.violating:
        shares.append(f"by the paper's definition {_percent(paper, total)}")
    shares += [
        f"landed {_percent(search.count('landed'), total)}",
        f"gave up {_percent(search.count('aborted'), total)}",
    ]
    late = sum(verdict.violation_type == "late" for verdict in verdicts)
    rare = {"late": late, **search.crashes}
    shares += [f"{word} {_percent(count, total)}" for word, count in rare.items() if count]
    if inconclusive := search.count("inconclusive"):
        shares.append(f"inconclusive {inconclusive}")
    if tenth := top_k(verdicts):
        shares.append(f"the tenth violation in flight {tenth}")
    return shares


def _percent(count: int, total: int) -> str:
    return f"{100 * count / total:.1f} %"
