"""Values of options as text: each is read, or refused with what was found and expected."""

from __future__ import annotations

import re
import urllib.parse
from typing import Literal, cast

import pytest

from pytest_garl.errors import GarlError

_URL = re.compile(r"[\w.~:/?#@!$&*+,;=%-]+", re.ASCII)
"""An address without what ends it in Markdown or HTML."""


def wrong(name: str, found: str, expected: str) -> pytest.UsageError:
    """Return the error of an option with a value that it cannot have."""
    return refused(f"--garl-{name}", found, expected)


def refused(where: str, found: str, expected: str) -> pytest.UsageError:
    """Return the error of an option or an ini key with a value that it cannot have."""
    return pytest.UsageError(f"{where}: found {found!r}, expected {expected}")


def integer(name: str, text: str, low: int) -> int:
    """Return a whole number of at least ``low``."""
    if not re.fullmatch(r"\d+", text) or int(text) < low:
        raise wrong(name, text, f"a whole number of at least {low}")
    return int(text)


def number(where: str, text: str, below: float, expected: str) -> float:
    """Return a number between 0 and ``below``, both excluded, for an option or key ``where``."""
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 < value < below:
        raise refused(where, text, expected)
    return value


def among(name: str, text: str, known: tuple[str, ...]) -> str:
    """Return one of the known words."""
    if text not in known:
        raise wrong(name, text, f"one of {', '.join(known)}")
    return text


def filmed(text: str, *, draws: bool) -> Literal["", "failures"]:
    """Return which flights have films; a process that ``draws`` needs an encoder.

    It is looked for at once: a search of hours shall not end without its films.
    """
    if not text:
        return ""
    among("film", text, ("failures",))
    if draws:
        from pytest_garl.reports.film.encoder import find_ffmpeg

        try:
            find_ffmpeg()
        except GarlError as error:
            raise pytest.UsageError(f"--garl-film={text}: {error}") from error
    return cast(Literal["failures"], text)


def report_url(text: str) -> str:
    """Return the address without a slash at its end."""
    parts = urllib.parse.urlsplit(text)
    if text and not (parts.scheme in ("http", "https") and parts.netloc and _URL.fullmatch(text)):
        raise refused("garl_report-url", text, "an address such as https://example.org/report")
    return text.rstrip("/")
