from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_garl.gate import gate_statistics
from pytest_garl.gate.comparison import Comparison, compare
from pytest_garl.gate.comparison_text import size_lines, summary_lines
from pytest_garl.gate.gate_statistics import can_reject, signed_rank_p
from pytest_garl.gate.pairs import FlightSummary, Pair
from pytest_garl.gate.relative import LIMITS

DOG = FlightSummary(outcome="collision", signature="IV:dog:descent:seen")
BLOCKED = FlightSummary(outcome="gave_up", signature="", no_landing="blocked")


def landing(distance_m: float = 0.1, time_s: float = 40.0) -> FlightSummary:
    return FlightSummary(outcome="landed", signature="", distance_m=distance_m, time_s=time_s)


def gate(befores: Sequence[FlightSummary], afters: Sequence[FlightSummary]) -> Comparison:
    return compare(
        [
            Pair(name=f"lawn-{index}", base=before, head=after)
            for index, (before, after) in enumerate(zip(befores, afters, strict=True))
        ]
    )


def enumerated_p(differences: Sequence[float]) -> float:
    """Return the p-value of the signed-rank test by trying all signs."""
    from scipy.stats import rankdata

    values = np.array([value for value in differences if value])
    if not len(values):
        return 1.0
    ranks = rankdata(np.abs(values))
    observed = ranks[values > 0].sum()
    signs = itertools.product((0, 1), repeat=len(values))
    return float(np.mean([np.dot(sign, ranks) >= observed - 1e-9 for sign in signs]))


@given(st.lists(st.integers(-4, 4), min_size=1, max_size=9))
def test_signed_rank_p_with_ties_agrees_with_all_signs(differences: list[int]) -> None:
    assert signed_rank_p(differences) == pytest.approx(enumerated_p(differences), rel=1e-9)


@pytest.mark.parametrize("count", [5, 20, 60, 200])
def test_signed_rank_p_without_ties_agrees_with_scipy(count: int) -> None:
    from scipy.stats import wilcoxon

    differences = np.random.default_rng(count).normal(0.2, 1.0, count)
    expected = wilcoxon(differences, alternative="greater", method="exact").pvalue
    assert signed_rank_p(differences.tolist()) == pytest.approx(expected, rel=1e-9)


def test_signed_rank_p_of_many_pairs_is_close_to_the_exact_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    differences = np.random.default_rng(0).normal(0.08, 1.0, 800).round(1).tolist()
    exact = signed_rank_p(differences)
    monkeypatch.setattr(gate_statistics, "LARGEST_EXACT", 10)
    assert 0.001 < exact < 0.2
    assert signed_rank_p(differences) == pytest.approx(exact, rel=0.01)


def test_signed_rank_p_is_smallest_if_all_differences_are_positive() -> None:
    assert signed_rank_p([0.1, 0.3, 0.2, 0.4, 0.5]) == 1 / 32
    assert signed_rank_p([0.1] * 5) == 1 / 32
    assert signed_rank_p([-0.1] * 5) == 1.0
    assert signed_rank_p([0.0, 0.0]) == 1.0
    assert can_reject(5, 0.05)
    assert not can_reject(4, 0.05)


@pytest.mark.parametrize(
    ("what", "before", "after", "exceeds"),
    [
        ("distance", 0.02, 0.07, False),
        ("distance", 0.02, 0.0701, True),
        ("distance", 0.4, 0.5, False),
        ("distance", 0.4, 0.501, True),
        ("time", 5.0, 6.0, False),
        ("time", 5.0, 6.1, True),
        ("time", 40.0, 44.0, False),
        ("time", 40.0, 44.1, True),
        ("time", 40.0, 20.0, False),
    ],
)
def test_a_limit_is_exceeded_by_more_than_both_of_its_parts(
    what: str, before: float, after: float, exceeds: bool
) -> None:
    (limit,) = (each for each in LIMITS if each.what == what)
    assert (limit.excess(before, after) > 0) is exceeds


def test_a_system_twenty_times_less_accurate_inside_its_limits_fails() -> None:
    found = gate([landing(0.02)] * 10, [landing(0.4)] * 10)
    assert found.failure_reasons == (
        "landings significantly less accurate: p 9.8e-04 at level 0.05",
    )
    lines = list(summary_lines(found))
    assert lines[-3:] == [
        "distance of 10 pairs that landed: median 0.02 -> 0.4 m, worst 0.02 -> 0.4 m: p 9.8e-04, "
        "level 0.05",
        "    by more than 25 % and 0.05 m: 10 less accurate, 0 the other way; lawn-0 most, 0.02 -> "
        "0.4 m",
        "time of 10 pairs that landed: median 40 -> 40 s, worst 40 -> 40 s: too few pairs differ "
        "to fail",
    ]


def test_a_slower_system_fails_and_a_faster_one_passes() -> None:
    slow, fast = [landing(time_s=52.0)] * 8, [landing(time_s=40.0)] * 8
    found = gate(fast, slow)
    assert found.failure_reasons == ("landings significantly slower: p 0.004 at level 0.05",)
    back = gate(slow, fast)
    assert back.passed
    assert "    by more than 10 % and 1 s: 0 slower, 8 the other way" in summary_lines(back)


def test_a_change_within_the_limit_passes_however_many_flights_show_it() -> None:
    found = gate([landing(0.02, 40.0)] * 300, [landing(0.069, 43.9)] * 300)
    assert found.passed
    assert [change.worse for change in found.sizes] == [0, 0]


def test_sizes_are_compared_where_both_landed() -> None:
    off = dataclasses.replace(landing(3.0), signature="I:line:seen")
    befores = [*[landing(0.02)] * 6, DOG, BLOCKED, *[landing(0.02)] * 7]
    afters = [*[landing(0.03)] * 6, landing(0.6), landing(0.6), BLOCKED, *[off] * 6]
    found = gate(befores, afters)
    assert [change.pairs for change in found.sizes] == [6, 6]
    assert [change.adjusted for change in found.sizes] == [None, None]


def test_sizes_and_rates_are_corrected_together() -> None:
    befores = [landing(0.02, 40.0)] * 15
    afters = [*[landing(0.4, 60.0)] * 9, *[BLOCKED] * 6]
    found = gate(befores, afters)
    assert found.tests == 3
    assert [change.adjusted for change in found.sizes] == [3 / 512, 3 / 512]
    assert found.safe_aborts.adjusted == 1 / 64


def test_sizes_are_not_compared_where_no_pair_landed() -> None:
    none_landed = list(summary_lines(gate([DOG] * 3, [DOG] * 3)))
    assert "distance and time not compared: in no pair did both flights land" in none_landed


def test_size_lines_show_median_and_worst_of_the_landings() -> None:
    assert list(size_lines([landing(0.1, 30.0), DOG, landing(0.3, 50.0), landing(0.2, 31.0)])) == [
        "distance of 3 landings: median 0.2 m, worst 0.3 m",
        "time of 3 landings: median 31 s, worst 50 s",
    ]
