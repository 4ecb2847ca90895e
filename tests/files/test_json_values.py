from __future__ import annotations

import dataclasses
import json
from typing import Literal

import pytest

from pytest_garl.files.json_values import dataclass_from, parse_json


@dataclasses.dataclass(frozen=True, kw_only=True)
class Inner:
    kind: Literal["a", "b"]
    pair: tuple[float, float]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Outer:
    name: str
    count: int
    share: float
    yes: bool
    inner: tuple[Inner, ...]
    maybe: Inner | None


GOOD = Outer(
    name="one",
    count=2,
    share=0.5,
    yes=True,
    inner=(Inner(kind="a", pair=(1.0, 2)),),
    maybe=None,
)


def test_a_dataclass_survives_json_to_the_byte() -> None:
    text = json.dumps(dataclasses.asdict(GOOD))
    assert dataclass_from(Outer, parse_json(text)) == GOOD
    assert json.dumps(dataclasses.asdict(dataclass_from(Outer, parse_json(text)))) == text


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"name": 1}, "name: found 1, expected a text"),
        ({"count": 2.0}, "count: found 2.0, expected a whole number"),
        ({"count": True}, "count: found True, expected a whole number"),
        ({"share": "x" * 5000}, "share: found 'xxx.*xxx', expected a finite number"),
        ({"share": 10**400}, "share: found 1000.*, expected a finite number"),
        ({"share": float("nan")}, "share: found nan, expected a finite number"),
        ({"yes": 1}, "yes: found 1, expected true or false"),
        ({"inner": {}}, "inner: found {}, expected a list"),
        ({"inner": [1]}, r"inner\[0\]: found 1, expected a table"),
        ({"inner": [{"kind": "c", "pair": [1, 2]}]}, r"inner\[0\].kind: found 'c', expected one"),
        ({"inner": [{"kind": [], "pair": [1, 2]}]}, r"inner\[0\].kind: found \[\], expected one"),
        ({"maybe": {"kind": "a", "pair": [1]}}, r"maybe.pair: found \[1\], expected a list of 2"),
        ({"maybe": {"kind": "a"}}, "maybe: found other keys than expected: pair"),
        ({"more": 1}, "the value: found other keys than expected: more"),
    ],
)
def test_a_wrong_field_is_named(change: dict[str, object], words: str) -> None:
    values = json.loads(json.dumps(dataclasses.asdict(GOOD))) | change
    with pytest.raises(ValueError, match=words) as caught:
        dataclass_from(Outer, values)
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * 100_000, "not valid JSON: nested too deeply"),
        ("9" * 5000, "not valid JSON: Exceeds the limit"),
        ("{", "not valid JSON: Expecting property name"),
        (b"\xff\xfe{", "not valid JSON: "),
        (b"\x80", "not valid JSON: 'utf-8' codec"),
    ],
    ids=["nested", "digits", "open", "utf-16", "bytes"],
)
def test_invalid_json_is_one_short_error(text: str | bytes, words: str) -> None:
    with pytest.raises(ValueError, match=words) as caught:
        parse_json(text)
    assert len(str(caught.value)) < 150
