"""A run in short, for ``garl report``, and words that several outputs share."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from pytest_garl.reports.run_record import KindRecord, RunRecord

RepeatCommand = Callable[[Sequence[str], str], str]
"""Makes the command that flies a slot again in these files."""
PAPER_DEFINITION = "by the paper's definition, which counts not landing"
"""How texts call the paper's definition: its type II is "no landing occurs"."""
LEGEND = {
    "I": "came down off the marker, on something else or on nothing",
    "II": "did not land: the marker could never be read, was lost, or was readable to the end",
    "III": "hit a fixed body",
    "IV": "hit a moving body",
    "V": "error, wrong answer, death or hang of the landing system",
    "late": "landed too late, or let the time run out in sight of the marker, on the ground or "
    "without giving up",
    "off": "came down too far from the marker, up to 1.5 m",
    "hard": "touched down too fast or tilted",
    "slid": "moved on over the ground after its touchdown",
    "abort": 'gave up where nobody could land, with limits(abort="violation")',
    "own": "an assertion of a test",
    "slow": "took more than three times as long as a nominal landing",
    "lost-while-detectable": "did not report the marker while it could be read",
}
"""Meanings of the types of violations and findings: a signature's part before the first colon."""
HELD_LEGEND = {
    "I": "had a target off the marker, on something else or on nothing",
    "II": "did not report the marker while it could be read",
    "IV": "planned a path through a moving body",
    "V": "gave up or had no plan, without need; or error, wrong answer, death or hang of the "
    "landing system",
    "late": "planned for the marker too late",
    "off": "had a target too far from the marker, up to 1.5 m",
}
"""Those that mean something else where the UAV holds its place."""


def legend_of(signatures: Iterable[str]) -> Mapping[str, str]:
    """Return the meanings of the types, for a search or a kind with these signatures."""
    held = any(part in ("hold", "plan") for each in signatures for part in each.split(":"))
    return {**LEGEND, **HELD_LEGEND} if held else LEGEND


def run_text(run: RunRecord) -> str:
    """Return a run in short, for ``garl report``."""
    lines = []
    for search in run.searches:
        late = search.not_landed
        lines.append(
            f"{search.name}: {search.flown} of {search.wanted} flown, "
            f"{search.landed} landed, {search.violating} violate "
            f"({search.violating_by_the_paper} {PAPER_DEFINITION}), "
            f"gave up: {counts_text(search.gave_up)}"
            f"{f'; ran out of time: {counts_text(late)}' if any(late.values()) else ''}"
        )
        lines += [f"  {text}" for text in search.told.values()]
        lines += [line for kind in search.kinds for line in _kind_lines(kind)]
    return "\n".join([*lines, ""]) if lines else "no flights yet\n"


def _kind_lines(kind: KindRecord) -> list[str]:
    title, *ending = [text for text in (kind.title, kind.headline) if text] or [""]
    least = ""
    if kind.case is not None and kind.case.severity.text:
        least = kind.least
    elif kind.case is None and kind.severity is not None and kind.severity.unusual:
        least = f"unusual in the mildest of them: {kind.severity.unusual}"
    texts = (*ending, least, kind.seen_in_control, kind.repeat)
    return [
        f"  {kind.count:4d}  {kind.signature}: {title}",
        *(f"        {text}" for text in texts if text),
    ]


def counts_text(counts: Mapping[Any, int]) -> str:
    """Return numbers with their names: ``needless 3, excused 0``."""
    return ", ".join(f"{name} {count}" for name, count in counts.items())


def percent(count: float, total: int, sign: str = " %") -> str:
    """Return a share in per cent: whole; if below 0.5, or of over a hundred, with a decimal."""
    share = 100 * count / total
    return f"{share:.{int(total > 100 or 0 < share < 0.5)}f}{sign}"
