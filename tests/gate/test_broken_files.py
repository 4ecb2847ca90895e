"""Hostile and oversized baselines: one short message each."""

from __future__ import annotations

from pathlib import Path

import pytest

from pytest_garl.errors import BaselineError, ScenarioError
from pytest_garl.gate import baseline_file as baselines
from pytest_garl.scenarios.maps.loading import load_map
from tests.gate.samples import baseline

BASELINE = baselines.dump_baseline(baseline())


@pytest.mark.parametrize(
    ("start", "end", "new", "words"),
    [
        ("cpu = ", "\n", "[" * 3000, "nested too deeply"),
        ("distance_m = ", ",", "9" * 400, "'set.0..limits.distance_m': found 999"),
        (
            "flights = ",
            "\n]",
            "[[" + "9" * 400 + ', "landed", "", false, "", [], "", []]',
            "the seed 99",
        ),
        ("flights = ", "\n]", '["' + "x" * 5000 + '"', r"'set\[0\].flights\[0\]': found 'xxx"),
        (
            "flights = ",
            "\n]",
            '[[0, "landed", "", false, "", [1], "", []]',
            "distance in m, time in s",
        ),
        ("flights = ", "\n]", '[[0, "landed", "", false, "lazy", [], "", []]', "found 'lazy'"),
        (
            "flights = ",
            "\n]",
            '[[0, "crashed", "", false, "", [], "", [1]]',
            "found 1 values of genes",
        ),
    ],
)
def test_broken_baseline_gives_one_short_error(start: str, end: str, new: str, words: str) -> None:
    begin = BASELINE.index(start) + len(start)
    text = BASELINE[:begin] + new + BASELINE[BASELINE.index(end, begin) :]
    with pytest.raises(ScenarioError, match=words) as caught:
        baselines.parse_baseline(text, load_map, source="base.toml")
    assert "base.toml" in str(caught.value)
    assert len(str(caught.value)) < 400


def test_gene_too_large_for_a_float_is_refused() -> None:
    row = BASELINE.index("\n  [", BASELINE.index("flights = ")) + len("\n  [")
    value = BASELINE.index('ab", [', row) + len('ab", [')
    text = f"{BASELINE[:value]}{'9' * 400}{BASELINE[BASELINE.index(',', value) :]}"
    with pytest.raises(ScenarioError, match=r"flights\[0\]': environment.dust: found 999.* to 1$"):
        baselines.parse_baseline(text, load_map, source="base.toml")


def test_oversized_baseline_is_neither_saved_nor_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(baselines, "LARGEST_BYTES", len(BASELINE) - 1)
    with pytest.raises(BaselineError, match=r"flights in .* bytes, expected at most"):
        baselines.save_baseline(tmp_path / "base.toml", baseline())
    (tmp_path / "base.toml").write_text(BASELINE)
    with pytest.raises(ScenarioError, match=r"bytes, expected at most .* `garl baseline save`"):
        baselines.load_baseline(tmp_path / "base.toml")
