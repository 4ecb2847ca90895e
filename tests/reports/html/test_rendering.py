from __future__ import annotations

import base64
import dataclasses
import hashlib
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.reports.html import rendering
from pytest_garl.reports.html.flight_tables import ConditionRow
from pytest_garl.reports.html.flight_task import ShownFlight
from pytest_garl.reports.html.kind_page import KindPage
from pytest_garl.reports.html.pictures import Still
from pytest_garl.reports.html.rendering import embedded_json, render_kind

HOSTILE = (
    "</script><script>alert(1)</script><img src=x onerror=alert(2)> {{ 7*7 }} \x1b[31m\u202e\x00"
)
"""Ends an element, begins another, is a template, colours a terminal, turns the text around."""
DATA: dict[str, Any] = {
    "end_s": 10.0,
    "metres": [{"name": HOSTILE, "kind": "height", "values": [1.0]}],
    "percent": [],
    "strips": [{"name": HOSTILE, "kind": "npc", "spans": [[0, 1]]}],
    "scene": None,
}


def page(text: str = "plain", data: dict[str, Any] | None = None) -> KindPage:
    flight = ShownFlight(
        description=text,
        data=data,
        stills=(
            Still(time_s=1.0, label=text, picture="data:image/jpeg;base64,AA==", facts=(text,)),
        ),
        notes=(text,),
        sightings=(text,),
        hints=(text,),
        conditions=(ConditionRow(name=text, value=text, nominal=text),),
        events=((1.0, text),),
        nearest=((text, text, text),),
        diagnostics=((1.0, text, text),),
        traceback=text,
    )
    return KindPage(
        name="page",
        title=text,
        ending=text,
        signature=text,
        meaning=text,
        where=text,
        description=text,
        subject=text,
        facts=((text, text),),
        commands=((text, text),),
        slots=(text,),
        more_slots=0,
        origin=((text, text),),
        other=(text, "other.html"),
        flight=flight,
    )


class Elements(HTMLParser):
    """The elements of a page, with the text of its scripts and styles."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str]] = []
        self.scripts: list[tuple[str, str]] = []
        self.styles: list[str] = []
        self._inside = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(name, value or "") for name, value in attrs]
        self._inside = tag
        if tag == "script":
            self.scripts.append((dict(attrs).get("type") or "", ""))

    def handle_endtag(self, tag: str) -> None:
        self._inside = ""

    def handle_data(self, data: str) -> None:
        if self._inside == "script":
            kind, text = self.scripts[-1]
            self.scripts[-1] = (kind, text + data)
        elif self._inside == "style":
            self.styles.append(data)


def policy_of(elements: Elements) -> str:
    (policy,) = (value for name, value in elements.attributes if value.startswith("default-src"))
    return policy


def sha256(text: str) -> str:
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    return f"'sha256-{digest}'"


def test_hostile_text_adds_no_element_and_no_control_character() -> None:
    plain, hostile = (Elements(render_kind(page(text, DATA))) for text in ("plain", HOSTILE))
    # Each word of a command is a span of its own.
    tags = [[tag for tag in each.tags if tag != "span"] for each in (plain, hostile)]
    assert tags[0] == tags[1]
    assert [name for name, _ in hostile.attributes] == [name for name, _ in plain.attributes]
    text = render_kind(page(HOSTILE, DATA))
    assert not re.search("[\x00-\x08\x0b-\x1f\u202e]", text)
    assert "{{ 7*7 }}" in text
    assert "\\x1b[31m" in text


def test_the_policy_allows_the_scripts_of_the_page_and_nothing_else() -> None:
    elements = Elements(render_kind(page(HOSTILE, DATA)))
    policy = policy_of(elements)
    allowed = re.findall(r"'sha256-[^']+'", policy.partition("script-src")[2])
    own = [text for kind, text in elements.scripts if not kind]
    assert len(own) == 5
    assert allowed == [sha256(text) for text in own]
    (style,) = elements.styles
    assert sha256(style) in policy.partition("style-src")[2].partition(";")[0]
    assert "unsafe" not in policy


def test_a_page_without_a_flight_runs_no_script() -> None:
    elements = Elements(render_kind(page(HOSTILE)))
    assert elements.scripts == []
    assert "script-src 'none'" in policy_of(elements)


def test_a_page_loads_nothing() -> None:
    elements = Elements(render_kind(page(HOSTILE, DATA)))
    addresses = [value for name, value in elements.attributes if name in ("src", "href", "action")]
    assert addresses
    assert all(re.match(r"data:|(\.\./)?[\w.-]+\.html$", each) for each in addresses)
    assert not any(name.startswith("on") or name == "style" for name, _ in elements.attributes)
    assert {"link", "iframe", "object", "form"} & {*elements.tags} == {"link"}


def test_embedded_values_come_back_and_end_no_element() -> None:
    text = str(embedded_json({"text": HOSTILE, "line": "\u2028&amp;"}))
    assert not set("<>&\u2028") & set(text)
    assert json.loads(text) == {"text": HOSTILE, "line": "\u2028&amp;"}


def test_a_number_that_is_not_finite_is_no_json() -> None:
    with pytest.raises(ValueError, match="JSON compliant"):
        embedded_json({"value": float("nan")})


def test_own_scripts_and_styles_end_no_element() -> None:
    files = [*rendering.HERE.glob("static/*"), *rendering.HERE.glob("vendor/uPlot.*min.*")]
    assert len(files) == 7
    for file in files:
        assert "</" not in re.sub(r"//[^\n]*", "", file.read_text()), file.name


def test_the_vendored_chart_keeps_its_licence() -> None:
    assert "MIT License" in (rendering.HERE / "vendor" / "uPlot.LICENSE").read_text()
    assert "v1.6.32" in (rendering.HERE / "vendor" / "uPlot.iife.min.js").read_text()[:80]


def test_own_scripts_are_readable() -> None:
    for file in sorted(Path(rendering.HERE).glob("static/*.js")):
        lines = file.read_text().splitlines()
        assert len(lines) <= 310, file.name
        assert max(map(len, lines)) <= 140, file.name


def test_the_same_page_has_the_same_bytes() -> None:
    first, second = (render_kind(page("plain", dict(DATA))) for _ in range(2))
    assert first == second
    changed = dataclasses.replace(page("plain", DATA), title="other")
    assert render_kind(changed) != first
