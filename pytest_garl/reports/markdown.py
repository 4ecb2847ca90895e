"""Tables, code and plain text in Markdown, as GitHub shows it."""

from __future__ import annotations

from collections.abc import Sequence


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
