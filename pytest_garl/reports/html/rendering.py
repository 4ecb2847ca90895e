"""From plain values to pages: templates with autoescape, style and scripts within the page.

A page may load nothing and run no script but its own: its Content-Security-Policy names the hash of
each, so that even a text that got through the escaping could do nothing.
"""

from __future__ import annotations

import base64
import functools
import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from pytest_garl.messages import printable
from pytest_garl.reports.html import charts, run_page
from pytest_garl.reports.html.kind_page import KindPage
from pytest_garl.reports.html.naming import GENERATOR, shown_file
from pytest_garl.reports.html.run_page import RunPage
from pytest_garl.reports.run_comparison import RunComparison, change_text

HERE = Path(__file__).parent
_SCRIPTS = ("cursor.js", "path.js", "timeline.js", "player.js")
_INDEX, _KIND, _COMPARISON = "index.html.jinja", "kind.html.jinja", "comparison.html.jinja"


def render_index(page: RunPage) -> str:
    """Return the index of a report."""
    return _render(
        _INDEX, page=page, view=run_page, charts=charts, shown_file=shown_file, scripts=()
    )


def render_kind(page: KindPage) -> str:
    """Return the page of a kind of violation."""
    data = page.flight.data
    scripts = (_text("vendor/uPlot.iife.min.js"), *(_text(f"static/{s}") for s in _SCRIPTS))
    return _render(_KIND, page=page, data=data, scripts=scripts if data else ())


def render_comparison(found: RunComparison) -> str:
    """Return the page that shows two runs side by side."""
    gained, lost = (
        sum(len(getattr(search, name)) for search in found.searches) for name in ("gained", "lost")
    )
    values = {"found": found, "gained": gained, "lost": lost, "change_text": change_text}
    return _render(_COMPARISON, scripts=(), **values)


def _render(template: str, *, scripts: tuple[str, ...], **values: Any) -> str:
    style = _text("static/page.css")
    if scripts:
        style += _text("vendor/uPlot.min.css")
    allowed = " ".join(map(_hash, scripts)) or "'none'"
    policy = (
        "default-src 'none'; img-src data:; media-src data:; base-uri 'none'; form-action 'none'; "
        f"style-src {_hash(style)}; script-src {allowed}"
    )
    return (
        _environment()
        .get_template(template)
        .render(
            **values,
            generator=GENERATOR,
            policy=policy,
            # Our own files, which hold no end tag; a test looks.
            style=Markup(style),
            scripts=[Markup(script) for script in scripts],
        )
    )


@functools.cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE / "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_shown,
    )
    environment.filters["embedded"] = embedded_json
    return environment


def _shown(value: Any) -> Any:
    """Write out control characters in all that a page shows; style and scripts are our own."""
    if isinstance(value, str) and not isinstance(value, Markup):
        return printable(value)
    return value


def embedded_json(value: Mapping[str, Any]) -> Markup:
    """Return JSON that can stand in a script element: no character of it ends the element."""
    text = json.dumps(value, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    for char in "<>&":
        text = text.replace(char, f"\\u{ord(char):04x}")
    return Markup(text)


def _hash(text: str) -> str:
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    return f"'sha256-{digest}'"


@functools.cache
def _text(name: str) -> str:
    return (HERE / name).read_text(encoding="utf-8")
