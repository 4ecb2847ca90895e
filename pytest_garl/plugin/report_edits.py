"""What can be made of an item's report: an expected failure, or one that says what happened."""

from __future__ import annotations

import pytest

from pytest_garl.plugin.wrapping import width_of, wrapped


def expect(report: pytest.TestReport, reason: str) -> None:
    """Make an expected failure of it."""
    report.outcome = "skipped"
    report.wasxfail = reason


def tell(report: pytest.TestReport, lines: list[str], what: str, again: str) -> None:
    """Add lines to a failure; say what happened, and how to see it, where one line is shown."""
    report.sections.append(("garl: what happened", "\n".join(lines)))
    crash = getattr(report.longrepr, "reprcrash", None)
    if crash is not None:
        # The short summary shows the first line, JUnit's message as many as fit.
        crash.message = f"{what}\n{again}"


def paragraphs(told: list[str], item: pytest.Item) -> list[str]:
    """Return sentences wrapped to the terminal's width."""
    width = width_of(item.config)
    return [wrapped(text, width, others="  ") for text in told]
