"""The report of the fault suite: mutation scores, families, flights to the first find, misses."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from lab.faults.catalogue import FAULTS, PLACEBO
from lab.table import Row

WITHIN = (25, 50, 100)
MISS = 100
"""Flights to the first find that a search without a find counts as."""
RIVAL = "random"
RESAMPLES = 10_000
Found = Mapping[tuple[str, str, str], int | None]
FAMILY_OF = {each.name: each.family for each in FAULTS}


def report(rows: Sequence[Row]) -> str:
    """Return the tables in Markdown; the placebo is no fault, and has a line of its own.

    A seed of which a method has flown fewer faults than of another one is left out.
    """
    rows, begun = whole_seeds(rows)
    flown: Found = {
        (row["method"], row["fault"], row["seed"]): int(row["found_at"] or 0) or None
        for row in rows
    }
    found = {key: at for key, at in flown.items() if key[1] != PLACEBO.name}
    methods = sorted({method for method, _, _ in flown})
    parts = [_scores(found, methods), _families(found, methods)]
    parts += [_ratios(found, method) for method in methods if method != RIVAL]
    parts += [_difficulty(found), _misses(found, methods, rows), _placebo(flown, methods)]
    if begun:
        parts.append(f"Not counted, because not all faults are flown: {', '.join(begun)}.")
    return "\n\n".join(part for part in parts if part)


def whole_seeds(rows: Sequence[Row]) -> tuple[list[Row], list[str]]:
    """Return the rows of seeds of which a method has flown all faults, and names of the others."""
    flown = Counter((row["method"], row["seed"]) for row in rows)
    whole = {method: max(flown[key] for key in flown if key[0] == method) for method, _ in flown}
    begun = {key for key, count in flown.items() if count < whole[key[0]]}
    names = [f"seed {seed} of {method}" for method, seed in sorted(begun)]
    return [row for row in rows if (row["method"], row["seed"]) not in begun], names


def score(found: Found, method: str, within: int) -> list[float]:
    """Return the mutation score of each seed: the share of the faults that were found in time."""
    seeds = sorted({seed for each, _, seed in found if each == method})
    return [
        float(
            np.mean(
                [
                    at is not None and at <= within
                    for (name, _, own), at in found.items()
                    if (name, own) == (method, seed)
                ]
            )
        )
        for seed in seeds
    ]


def mean_text(values: Sequence[float]) -> str:
    """Return the mean in percent, with its 95 % t-interval if there are several values."""
    if not values:
        return "not flown"
    mean = 100 * float(np.mean(values))
    if len(values) < 2:
        return f"{mean:.0f} %"
    from scipy.stats import t

    half = 100 * float(np.std(values, ddof=1)) / len(values) ** 0.5
    half *= float(t.ppf(0.975, len(values) - 1))
    return f"{mean:.0f} % [{max(0.0, mean - half):.0f}, {min(100.0, mean + half):.0f}]"


def _scores(found: Found, methods: Iterable[str]) -> str:
    lines = [
        "Mutation score: share of faults found, mean over seeds with a 95 % t-interval over them.",
        "",
        f"| method | faults | seeds | {' | '.join(f'within {each}' for each in WITHIN)} |",
        f"| --- | --- | --- |{' --- |' * len(WITHIN)}",
    ]
    for method in methods:
        own = [key for key in found if key[0] == method]
        faults, seeds = ({key[index] for key in own} for index in (1, 2))
        cells = " | ".join(mean_text(score(found, method, each)) for each in WITHIN)
        lines.append(f"| {method} | {len(faults)} | {len(seeds)} | {cells} |")
    return "\n".join(lines)


def _families(found: Found, methods: list[str]) -> str:
    lines = [f"Within {WITHIN[-1]} flights, by family.", "", f"| family | {' | '.join(methods)} |"]
    lines.append(f"| --- |{' --- |' * len(methods)}")
    for family in dict.fromkeys(FAMILY_OF.values()):
        own = {key: at for key, at in found.items() if FAMILY_OF[key[1]] == family}
        if own:
            cells = (mean_text(score(own, each, WITHIN[-1])) for each in methods)
            lines.append(f"| {family} | {' | '.join(cells)} |")
    return "\n".join(lines)


def flights_by_fault(found: Found, method: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the mean flights to the first find of a method and of its rival, one per fault.

    Only seeds that both have flown count.
    """
    pairs: dict[str, list[tuple[int, int]]] = {}
    for (name, fault, seed), at in found.items():
        rival = (RIVAL, fault, seed)
        if name == method and rival in found:
            pairs.setdefault(fault, []).append((at or MISS, found[rival] or MISS))
    means = np.array([np.mean(each, axis=0) for each in pairs.values()]).reshape(-1, 2)
    return means[:, 0], means[:, 1]


def ratio_interval(
    own: NDArray[np.float64], rival: NDArray[np.float64]
) -> tuple[float, float, float]:
    """Return the ratio of mean flights, and its 95 % interval by a bootstrap over faults."""
    rng = np.random.default_rng(0)
    drawn = rng.integers(len(own), size=(RESAMPLES, len(own)))
    ratios = own[drawn].mean(axis=1) / rival[drawn].mean(axis=1)
    low, high = np.quantile(ratios, [0.025, 0.975])
    return float(own.mean() / rival.mean()), float(low), float(high)


def _ratios(found: Found, method: str) -> str:
    lines = [
        f"Flights of {method} to the first find, as a multiple of those of {RIVAL}: paired by "
        f"fault and seed, a miss counts {MISS}, bootstrap over faults.",
        "",
        "| family | faults | ratio |",
        "| --- | --- | --- |",
    ]
    for family in ("all", *dict.fromkeys(FAMILY_OF.values())):
        own, rival = flights_by_fault(
            {key: at for key, at in found.items() if family in ("all", FAMILY_OF[key[1]])}, method
        )
        if len(own):
            ratio, low, high = ratio_interval(own, rival)
            lines.append(f"| {family} | {len(own)} | {ratio:.2f} [{low:.2f}, {high:.2f}] |")
    return "\n".join(lines) if len(lines) > 4 else ""


def _difficulty(found: Found) -> str:
    shares = found_shares(found, RIVAL)
    if not shares:
        return ""
    hard = [fault for fault, (count, total) in shares.items() if 2 * count < total]
    return (
        f"{RIVAL} finds {len(hard)} of {len(shares)} faults in under half of the seeds: "
        f"{', '.join(hard) or 'none'}."
    )


def found_shares(found: Found, method: str) -> dict[str, tuple[int, int]]:
    """Return in how many searches of a method each fault was found, and the number of searches."""
    counts: dict[str, tuple[int, int]] = {}
    for (name, fault, _), at in found.items():
        if name == method:
            count, total = counts.get(fault, (0, 0))
            counts[fault] = count + (at is not None), total + 1
    return {fault: counts[fault] for fault in (*FAMILY_OF, PLACEBO.name) if fault in counts}


def _placebo(found: Found, methods: Iterable[str]) -> str:
    counts = {each: found_shares(found, each).get(PLACEBO.name) for each in methods}
    told = [f"{each} in {count[0]} of {count[1]}" for each, count in counts.items() if count]
    return f"Searches in which chance found the placebo: {', '.join(told)}." if told else ""


def _misses(found: Found, methods: Iterable[str], rows: Sequence[Row]) -> str:
    lines = []
    for method in methods:
        shares = found_shares(found, method).items()
        missed = [
            f"{fault} ({count} of {total}{_why(rows, method, fault)})"
            for fault, (count, total) in shares
            if count < total
        ]
        lines.append(f"Not found by {method} in every seed: {', '.join(missed) or 'none'}.")
    return "\n".join(lines)


def _why(rows: Sequence[Row], method: str, fault: str) -> str:
    """Return how often what fires a fault acted in the searches that missed it, and what hid it."""
    own = [
        row
        for row in rows
        if (row["method"], row["fault"], row["found_at"]) == (method, fault, "") and row["acted"]
    ]
    if not own:
        return ""
    acted, masked = (
        100 * np.mean([int(row[name]) / int(row["flights"]) for row in own])
        for name in ("acted", "masked")
    )
    return (
        f"; all that acts in its scenario acted in {acted:.0f} % of flights, {masked:.0f} % masked"
    )
