from __future__ import annotations

import json

import pytest

from lab import nights
from lab.table import Row


def row(variant: str, seed: str, *kinds: int) -> dict[str, str]:
    names = {"variant": variant, "landing": "sturdy", "seed": seed, "map": "court"}
    return {**names, "kinds": json.dumps(kinds), "violations": "9"}


def test_later_nights_are_compared_in_pairs() -> None:
    rows: list[Row] = [row("alone", seed, 3, 4, 4, 4, 5) for seed in "123"]
    rows += [row("archive", seed, 3, 5, 5, 5, 8) for seed in "123"]
    # Without its rival a row says nothing.
    rows += [row("archive", "4", 3, 9, 9, 9, 9)]
    assert nights.report(rows).splitlines()[2:] == [
        "| sturdy | 3 | 3.0 | second | 1.0 | 2.0 | +1.0 ± 0.0 |",
        "| sturdy | 3 | 3.0 | second to fifth | 2.0 | 5.0 | +3.0 ± 0.0 |",
    ]


def test_nights_with_an_archive_begin_with_the_same_night(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nights, "NIGHTS", 2)
    monkeypatch.setattr(nights, "BUDGET", 30)
    alone, kept = (
        nights.fly_nights((variant, "ordinary", "7", "lawn")) for variant in nights.VARIANTS
    )
    first, both = json.loads(alone["kinds"])
    assert first == json.loads(kept["kinds"])[0]
    assert len(json.loads(kept["kinds"])) == 2
    assert both >= first
    assert alone["violations"] != kept["violations"]
