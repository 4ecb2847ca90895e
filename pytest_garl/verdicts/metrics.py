"""Figures over many verdicts: shares with their intervals, Top-K."""

from __future__ import annotations

from collections.abc import Sequence

from pytest_garl.verdicts.verdict import Verdict


def share_interval(count: int, total: int, level: float = 0.95) -> tuple[float, float]:
    """Exact (Clopper-Pearson) interval of a share, as fractions."""
    if total == 0:
        return 0.0, 1.0
    from scipy.stats import beta

    tail = (1 - level) / 2
    low = float(beta.ppf(tail, count, total - count + 1)) if count else 0.0
    high = float(beta.ppf(1 - tail, count + 1, total - count)) if count < total else 1.0
    return low, high


def top_k(verdicts: Sequence[Verdict], k: int = 10) -> int | None:
    """How many flights it took to find the first ``k`` violations; None if there are fewer."""
    found = 0
    for index, verdict in enumerate(verdicts, start=1):
        found += verdict.paper_violation
        if found == k:
            return index
    return None
