"""Text that fits the terminal, also where an xdist worker writes it."""

from __future__ import annotations

import re
import textwrap
from typing import Any

import pytest

WIDTH = "garl_width"
"""What xdist's controller tells its workers about the terminal."""
_NARROW = 40
_HARD_SPACE = "\N{NO-BREAK SPACE}"
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:%|m/s|m|s)(?!\w))")


def width_of(config: pytest.Config) -> int:
    """Return how many columns there are; as pytest does, 80 where there is no terminal."""
    given: dict[str, Any] = getattr(config, "workerinput", {})
    if WIDTH in given:
        return max(_NARROW, int(given[WIDTH]))
    reporter: Any = config.pluginmanager.get_plugin("terminalreporter")
    return max(_NARROW, reporter._tw.fullwidth) if reporter is not None else 80


def wrapped(text: str, width: int, *, first: str = "", others: str = "") -> str:
    """Return text in lines of at most ``width`` columns; no word is broken, no unit left alone."""
    return textwrap.fill(
        _BEFORE_UNIT.sub(_HARD_SPACE, text),
        width,
        initial_indent=first,
        subsequent_indent=others,
        break_long_words=False,
        break_on_hyphens=False,
    ).replace(_HARD_SPACE, " ")


def counted(number: int, noun: str) -> str:
    """Return a number with its noun: ``1 flight``, ``2 flights``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def begin_line(reporter: Any) -> None:
    """Have pytest's reporter begin a line, also where it believes that it has just begun one."""
    reporter.ensure_newline()
    if reporter._tw.width_of_current_line:
        reporter.line("")
