"""The text of a comparison: whether the gate passes, the figures, and the pairs that differ."""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Sequence

from pytest_garl.gate.comparison import Comparison, names_of, p_text
from pytest_garl.gate.new_types import NewType
from pytest_garl.gate.pairs import DIFFERENT_RESULTS, FlightSummary, column_counts
from pytest_garl.gate.rates import RateChange
from pytest_garl.gate.relative import LIMITS, RelativeChange

PAIRS_LISTED = 20
"""Number of pairs of each result that a report lists."""
WIDTH = 12
"""Characters of a column of counts."""


def summary_lines(found: Comparison) -> Iterator[str]:
    """Yield whether the gate passes, then lines about the rates, the sizes and what is new."""
    yield "gate passed" if found.passed else f"gate FAILED: {'; '.join(found.failure_reasons)}"
    identical = sum(pair.identical for pair in found.pairs)
    yield f"{len(found.pairs)} pairs compared, {identical} of them the same flight to the byte"
    if found.left_out:
        yield f"{found.left_out} left out: inconclusive when the baseline was saved"
    yield from column_lines(
        ("before", [pair.base for pair in found.pairs]),
        ("after", [pair.head for pair in found.pairs]),
    )
    for change, broke, fixed in (
        (found.violations, "broke", "fixed"),
        (found.grave, "graver than giving up", "milder"),
        (found.safe_aborts, "landings lost", "landings won"),
    ):
        if change is not found.grave or change.broke + change.fixed:
            yield (
                f"{change.what} {change.base} -> {change.head} ({change.broke} {broke}, "
                f"{change.fixed} {fixed}): {_p_values(found, change)}"
            )
    for size in found.sizes:
        yield from _change_lines(found, size)
    if not found.sizes:
        yield "distance and time not compared: in no pair did both flights land"
    for new in found.new_types:
        fails = new.is_supported and found.is_significant(new)
        doubt = "" if fails else ": may be chance, look at it"
        yield f"new type of violation: {new.text}: {_p_values(found, new)}{doubt}"
    for signature, pairs in found.new_signatures:
        yield f"new kind of a known type, not gated: {signature} in {names_of(pairs)}"


def report_lines(found: Comparison) -> Iterator[str]:
    """Yield the lines of the summary, then the pairs that differ."""
    yield from summary_lines(found)
    for result in DIFFERENT_RESULTS:
        pairs = found.with_result(result)
        for pair in pairs[:PAIRS_LISTED]:
            yield f"{result:<8} {pair.text}"
        if len(pairs) > PAIRS_LISTED:
            yield f"{result:<8} and {len(pairs) - PAIRS_LISTED} more"


def column_lines(*rows: tuple[str, Sequence[FlightSummary]]) -> Iterator[str]:
    """Yield a table with a row for each named list of flights, landed ones first."""
    counts = [(name, column_counts(flights), flights) for name, flights in rows]
    columns = list(dict.fromkeys(column for _, found, _ in counts for column in found))
    first = max(len(name) for name, _ in rows) + 2
    yield (" " * first + "".join(f"{column:<{WIDTH}}" for column in columns)).rstrip()
    for name, found, flights in counts:
        decided = sum(each.decided for each in flights)
        percent = f" ({100 * found['landed'] / decided:.0f} %)" if decided else ""
        cells = [f"{found['landed']}{percent}", *(str(found.get(each, 0)) for each in columns[1:])]
        yield (f"{name:<{first}}" + "".join(f"{cell:<{WIDTH}}" for cell in cells)).rstrip()


def size_lines(flights: Sequence[FlightSummary]) -> Iterator[str]:
    """Yield median and worst distance and time of the flights that landed."""
    for limit in LIMITS:
        values = [value for each in flights if (value := limit.value(each)) is not None]
        if values:
            median, worst = statistics.median(values), max(values)
            yield (
                f"{limit.what} of {len(values)} landings: median {median:.3g} {limit.unit}, worst "
                f"{worst:.3g} {limit.unit}"
            )


def _change_lines(found: Comparison, change: RelativeChange) -> Iterator[str]:
    limit, (before, after), (base, head) = change.limit, change.medians, change.worsts
    yield (
        f"{limit.what} of {change.pairs} pairs that landed: median {before:.3g} -> {after:.3g} "
        f"{limit.unit}, worst {base:.3g} -> {head:.3g} {limit.unit}: {_p_values(found, change)}"
    )
    if change.worse or change.better:
        name, first, second = change.worst
        example = f"; {name} most, {first:.3g} -> {second:.3g} {limit.unit}" if change.worse else ""
        yield (
            f"    by more than {limit.text}: {change.worse} {limit.worse}, {change.better} the "
            f"other way{example}"
        )


def _p_values(found: Comparison, test: RateChange | RelativeChange | NewType) -> str:
    if test.adjusted is None:
        return "too few pairs differ to fail"
    together = f", for all {found.tests} tests {p_text(test.adjusted)}" if found.tests > 1 else ""
    return f"p {p_text(test.p)}{together}, level {found.level:g}"
