"""Where the pages of a run are written, and where they will be published."""

from __future__ import annotations

import re
import urllib.parse
from pathlib import Path

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.plugin.option_values import wrong

_URL = re.compile(r"[\w.~:/?#@!$&*+,;=%-]+", re.ASCII)
"""An address without what ends it in Markdown or HTML."""


def report_folder(config: pytest.Config) -> Path | None:
    """Return the folder: the command line's as seen from here, the ini key's from the root.

    It is checked at once: a search of hours shall not end without its report.
    """
    given = config.getoption("--garl-report")
    text, folder = str(given or ""), Path()
    if not text:
        text, folder = str(config.getini("garl_report")), config.rootpath
    if not text:
        return None
    from pytest_garl.reports.html.folder import check_target

    try:
        check_target(folder / text)
    except GarlError as error:
        raise pytest.UsageError(f"--garl-report: {error}") from error
    return folder / text


def report_url(text: str) -> str:
    """Return the address without a slash at its end."""
    parts = urllib.parse.urlsplit(text)
    if text and not (parts.scheme in ("http", "https") and parts.netloc and _URL.fullmatch(text)):
        raise wrong("report-url", text, "an address such as https://example.org/report")
    return text.rstrip("/")
