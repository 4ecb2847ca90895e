"""Text that fits the terminal, also if an xdist worker writes it."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Iterable, Sequence
from contextlib import nullcontext
from typing import Any

import pytest

from pytest_garl.plugin.xdist import WIDTH

MOST_NAMED = 5
"""A line names this many flights and counts the rest."""
_NARROW = 40
_HARD_SPACE = "\N{NO-BREAK SPACE}"
_WITHIN_AMOUNT = re.compile(
    r"(?<=\d) (?=(?:%|m/s|m|s)(?!\w))|(?<=%) (?=\[\d)|(?<=\d,) (?=[\d.]+\])"
)
"""The spaces before a unit, before an interval in per cent, and in it."""


def width_of(config: pytest.Config) -> int:
    """Return the number of columns; without a terminal 80, as for pytest."""
    given = getattr(config, "workerinput", {}).get(WIDTH)
    if given is not None:
        return max(_NARROW, int(given))
    reporter: Any = config.pluginmanager.get_plugin("terminalreporter")
    return max(_NARROW, reporter._tw.fullwidth) if reporter is not None else 80


def wrapped(text: str, width: int, *, first: str = "", others: str = "") -> str:
    """Return text in lines of at most ``width`` columns that split no word and no amount."""
    return textwrap.fill(
        _WITHIN_AMOUNT.sub(_HARD_SPACE, text),
        width,
        initial_indent=first,
        subsequent_indent=others,
        break_long_words=False,
        break_on_hyphens=False,
    ).replace(_HARD_SPACE, " ")


def counted(number: int, noun: str) -> str:
    """Return a number with its noun: ``1 flight``, ``2 flights``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def listed(names: Sequence[str]) -> str:
    """Return the first names, and how many more there are."""
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return ", ".join(names[:MOST_NAMED]) + more


def duration(seconds: float) -> str:
    """Return a duration in seconds or minutes."""
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"


def begin_line(reporter: Any) -> None:
    """Make pytest's reporter begin a line, even if it believes that it has just begun one."""
    reporter.ensure_newline()
    if reporter._tw.width_of_current_line:
        reporter.line("")


def write_lines(config: pytest.Config, lines: Callable[[int], Iterable[str]]) -> None:
    """Write lines of their own, made for a width, also while pytest captures what a test prints."""
    reporter: Any = config.pluginmanager.get_plugin("terminalreporter")
    capture: Any = config.pluginmanager.get_plugin("capturemanager")
    if reporter is None:
        return
    with capture.global_and_fixture_disabled() if capture else nullcontext():
        begin_line(reporter)
        # Captured, standard output is no terminal and has no width.
        for line in lines(width_of(config)):
            reporter.write_line(line)
        # A pipe, such as the log of a build server, would get it with the next test's dot.
        reporter.flush()
