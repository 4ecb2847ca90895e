"""Why a session must not be green although no item failed, and what else its colour leaves open."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

from pytest_garl.execution.slot import Slot
from pytest_garl.plugin.options import Options
from pytest_garl.plugin.run import Run
from pytest_garl.plugin.tally import Tally

SHARE = 20
"""One in so many flights of a search may come to no result, or fail without repeating it."""
NAMED = 5
"""So many flights are named; the rest are counted."""


def problems(tally: Tally, run: Run | None, options: Options) -> Iterator[str]:
    """Yield why the session fails, beside its items."""
    unfounded = tally.unfounded()
    if unfounded:
        yield (
            f"{_counted(len(unfounded), 'test')} excused by a failure that no test shows (its test "
            f"was skipped, passed or was expected to fail): {_names(unfounded)}"
        )
    if run is not None and run.options.searches:
        yield from _undecided(run)
        yield from _unrepeated(tally, run)
    if (options.searches or "map" in options.given) and tally.items and not tally.flown:
        yield f"nothing was flown, though it was asked for: {_why(tally)}"


def notes(tally: Tally) -> Iterator[str]:
    """Yield what a green session leaves open."""
    if tally.items and not tally.flown:
        yield f"nothing was flown: {_why(tally)}"
    if tally.unasserted:
        kinds = [f"{name} ({_counted(n, 'flight')})" for name, n in tally.unasserted.most_common()]
        yield f"no selected test fails for these violations: {', '.join(kinds)}"
    for (system, map), slots in sorted(_by_search(tally).items()):
        words = _counted(len(slots), "violation")
        yield f"{_name(system, map)}: {words} did not repeat: {_names(slots)}"


def _why(tally: Tally) -> str:
    """Say why the items of a session flew nothing."""
    reasons = [reason for reason, _ in tally.nothing.most_common()]
    return "; ".join(reasons) or "all landing tests were skipped before they asked for a landing"


def _undecided(run: Run) -> Iterator[str]:
    """Yield which searches left too many flights without a result."""
    flown: Counter[tuple[str, str]] = Counter()
    without: dict[tuple[str, str], list[str]] = {}
    for system, map, generation, index, result in run.ledger.queries.results():
        flown[system, map] += 1
        if result.inconclusive:
            slot = Slot(generation=generation, index=index).id(map)
            without.setdefault((system, map), []).append(slot)
    for (system, map), slots in without.items():
        allowed = flown[system, map] // SHARE
        if len(slots) > allowed:
            yield (
                f"{_name(system, map)}: {len(slots)} of {flown[system, map]} flights are "
                f"inconclusive, at most {allowed} may be: {_names(slots)}. Fly them while the "
                "machine has nothing else to do, or allow more time with --garl-timeout"
            )


def _unrepeated(tally: Tally, run: Run) -> Iterator[str]:
    """Yield which searches found too many violations that did not show again."""
    flown = Counter((system, map) for system, map, *_ in run.ledger.queries.results())
    for (system, map), slots in _by_search(tally).items():
        allowed = max(1, flown[system, map] // SHARE)
        if len(slots) > allowed:
            yield (
                f"{_name(system, map)}: {len(slots)} violations in {flown[system, map]} flights "
                f"did not repeat, at most {allowed} may: {_names(slots)}"
            )


def _by_search(tally: Tally) -> dict[tuple[str, str], list[str]]:
    found: dict[tuple[str, str], set[str]] = {}
    for system, map, slot, signature in tally.unrepeated:
        found.setdefault((system, map), set()).add(f"{slot} ({signature})")
    return {search: sorted(slots) for search, slots in found.items()}


def _name(system: str, map: str) -> str:
    return f"{system.split(':')[-1]} on {map}"


def _names(names: Sequence[str]) -> str:
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more


def _counted(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"
