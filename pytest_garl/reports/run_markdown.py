"""A run in Markdown, as GitHub shows it under a step; and tables, code and plain text for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pytest_garl.reports.run_record import WHY_NO_LANDING, KindRecord, RunRecord, SearchRecord
from pytest_garl.reports.run_text import PAPER_DEFINITION, RepeatCommand, percent

KINDS = (
    "where",
    "what",
    "flights",
    "what happened",
    "conditions",
    "see it",
    "page",
)
SHARES = (
    "where",
    "flown",
    "landed",
    "violations",
    PAPER_DEFINITION,
    *(f"gave up: {reason}" for reason in WHY_NO_LANDING),
    "not landed",
    "crashed",
    "inconclusive",
)

Row = tuple[str, ...]
"""The cells of a row, in Markdown."""


def run_markdown(
    run: RunRecord,
    repeat: RepeatCommand,
    pages: Mapping[tuple[str, str], str],
    failed: Sequence[Row] = (),
) -> list[str]:
    """Return a table of shares, remarks, and a table of the kinds of violation.

    ``pages`` are links to pages of kinds, by the name of the search and the signature; ``failed``
    are rows that follow those of the kinds.
    """
    rows: list[Row] = [
        (
            escaped(search.name),
            escaped(kind.signature),
            escaped(_flights(kind)),
            escaped("; ".join(filter(None, (kind.title, kind.headline)))),
            escaped(kind.least),
            code(repeat(search.key.files, kind.first)),
            pages.get((search.name, kind.signature), ""),
        )
        for search in run.searches
        for kind in search.kinds
    ]
    rows += failed
    shares = [_shares(search) for search in run.searches]
    flown = f" in {run.flown} flights" if run.flown else ""
    return [
        *([table(SHARES, shares)] if shares else []),
        *(escaped(f"{each.name}: {line}") for each in run.searches for line in each.remarks),
        kinds_table(rows) if rows else f"No violation{flown}.",
    ]


def kinds_table(rows: Sequence[Row]) -> str:
    """Return the table of kinds; without links to pages it has no column for them."""
    columns = len(KINDS) - (not any(row[-1] for row in rows))
    return table(KINDS[:columns], [row[:columns] for row in rows])


def _flights(kind: KindRecord) -> str:
    """Return the number of flights of a kind and, with a control arm, of the random ones."""
    if kind.in_control is None:
        return str(kind.count)
    return f"{kind.count} ({kind.in_control} of {kind.random_flights} random)"


def _shares(search: SearchRecord) -> Row:
    """Return the shares of a search, a cell for each of ``SHARES``."""
    counts = [
        search.landed,
        search.violating,
        search.violating_by_the_paper,
        *(search.gave_up[reason] for reason in WHY_NO_LANDING),
        search.outcomes["not_landed"],
        sum(search.crashes.values()),
        len(search.inconclusive),
    ]
    shares = (percent(count, search.flown) for count in counts)
    return escaped(search.name), str(search.flown), *shares


def table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table; the cells are Markdown."""
    lines = [f"| {' | '.join(columns)} |", f"|{' --- |' * len(columns)}"]
    lines += [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join(lines)


def escaped(text: str) -> str:
    """Return text in one line, without meaning in Markdown or HTML."""
    for mark in "\\`*_[]<>|#~&":
        text = text.replace(mark, f"\\{mark}")
    return " ".join(text.split())


def code(text: str) -> str:
    """Return text as code that may stand in a cell of a table, or nothing."""
    plain = " ".join(text.replace("`", "").replace("|", "\\|").split())
    return f"`{plain}`" if plain else ""
