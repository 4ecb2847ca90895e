"""The index of a report as Markdown: the parts that the summary of a build shows below its tables.

GitHub removes pictures that a text holds itself (``data:`` addresses), so pictures and links need
the address under which the folder of the report is published.
"""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from pytest_garl.reports.html.naming import INDEX
from pytest_garl.reports.run_markdown import code, escaped, table

if TYPE_CHECKING:
    from pytest_garl.reports.html.kind_page import Fact
    from pytest_garl.reports.html.run_page import KindRow, RunPage

PICTURE_WIDTH = 320
MOST_PICTURES = 24


def page_link(kind: KindRow, folder: Path, url: str) -> str:
    """Return a link to the page of a kind, or its file if the report is published nowhere."""
    return (
        f"[page]({url}/{kind.page.address})" if url else code(f"{folder.name}/{kind.page.address}")
    )


def index_parts(page: RunPage, folder: Path, url: str) -> list[str]:
    """Return the parts of a summary: where the pages are, pictures, phases, domain and cost."""
    from pytest_garl.reports.html.run_page import (
        cost_rows,
        domain_rows,
        origin_rows,
        phase_rows,
    )
    from pytest_garl.reports.run_record import PHASES

    if url:
        where = f"[The whole report]({url}/{INDEX})"
    else:
        where = (
            f"The whole report is {code(f'{folder.name}/{INDEX}')}. With the ini key "
            "`garl_report-url` this summary links to it and shows a picture of each kind."
        )
    parts = [where, *(escaped(note) for note in page.notes)]
    parts += _pictures(page, url) if url else []
    rows = [
        (escaped(name), *(str(count or "") for count, _ in cells), escaped(meaning))
        for name, meaning, cells in phase_rows(page.run)
    ]
    parts += [table(("type", *PHASES, "what it means"), rows)] if rows else []
    facts = (
        ("Domain", domain_rows(page.run)),
        ("Cost", cost_rows(page.run)),
        ("Hashes and versions", origin_rows(page.run)),
    )
    return parts + [_folded(title, pairs) for title, pairs in facts if pairs]


def _pictures(page: RunPage, url: str) -> list[str]:
    """Return the picture of each kind that shows its cause, in the order of the index."""
    shown = [kind for kind in page.kinds if kind.still]
    parts = [_picture(kind, url) for kind in shown[:MOST_PICTURES]]
    left = len(shown) - len(parts)
    return [*parts, f"{left} more kinds have pictures in the report."] if left > 0 else parts


def _picture(kind: KindRow, url: str) -> str:
    page = kind.page
    return (
        f'<a href="{url}/{page.address}"><img src="{url}/{kind.still}" width="{PICTURE_WIDTH}" '
        f'alt="{escape(page.signature)}"></a><br>'
        f"{escaped(page.signature)}, {escaped(page.where)}: {escaped(page.title)}"
    )


def _folded(title: str, pairs: tuple[Fact, ...]) -> str:
    rows = [(escaped(label), escaped(text)) for label, text in pairs]
    return f"<details><summary>{title}</summary>\n\n{table(('', ''), rows)}\n\n</details>"
