"""The paper's claims, each with what the rows of its experiment say of it.

A claim that one figure is above another is judged by pairs of searches of equal map and seed. It is

- **reproduced** if the mean difference has the claimed sign, and p of the signs is at most 0.05;
- **in direction** if only the mean has it;
- **not reproduced** if not even the mean has it;
- **not flown** if there are no pairs yet.

A claim about most of the violations is reproduced if it holds in each search, in direction if it
holds for all of them together.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np

from lab.experiment.metrics import ITS_CODE, ITS_COVERAGE, ITS_TOP10, Metric
from lab.experiment.results import ResultRow
from lab.judges.intervals import p_of_signs

OWN, AGENT_ALONE = "garl-paper", "surrogate-random"
"""The paper's method, and the one with its NPCs and without its GA."""
RIVALS = ("ga", "random", "offline-rl", "online-rl", "surrogate-random")
LARGEST_P = 0.05
HARDLY_POINTS, LONGER = 2.0, 1.25
"""The paper's difference is 0.7 points, and its ratio of hours 1.09."""
NOT_FLOWN = ("–", "not flown")
WEATHER_DISTANCE = Metric(
    title="distance of weather", value_of=lambda row: row.weather_distance, digits=2
)
HOURS = Metric(
    title="hours",
    value_of=lambda row: (row.flying_s + row.idle_s) / row.workers / 3600,
    digits=2,
)

Rows = Sequence[ResultRow]
Finding = tuple[str, str]
"""What the rows say, and the verdict."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """A claim of the paper in our words, and what rows say of it."""

    text: str
    judge: Callable[[Rows], Finding]


def _of(
    rows: Rows, system: str, method: str = OWN, map: str = ""
) -> dict[tuple[str, int], ResultRow]:
    """Return the rows of a system by a method, by map and seed."""
    return {
        (row.map, row.seed): row
        for row in rows
        if (row.system, row.method) == (system, method) and map in ("", row.map)
    }


def _above(
    metric: Metric, higher: tuple[str, str], lower: tuple[str, str], map: str = "", sign: int = 1
) -> Callable[[Rows], Finding]:
    """Judge that a metric of one (system, method) is above that of another; below with sign -1."""

    def judge(rows: Rows) -> Finding:
        first, second = _of(rows, *higher, map=map), _of(rows, *lower, map=map)
        gaps = [
            metric.value_of(first[key]) - metric.value_of(second[key])
            for key in first
            if key in second
        ]
        if not gaps:
            return NOT_FLOWN
        p, mean = p_of_signs(gaps), float(np.mean(gaps))
        figure = f"{mean:+.{metric.digits}f} ({len(gaps)} pairs, p = {p:.2f})"
        if sign * mean <= 0:
            return figure, "not reproduced"
        return figure, "reproduced" if p <= LARGEST_P else "in direction"

    return judge


def _above_all(metric: Metric, sign: int = 1) -> Callable[[Rows], Finding]:
    """Judge that the paper's method is better than each rival: the weakest of the verdicts."""

    def judge(rows: Rows) -> Finding:
        found = {
            rival: _above(metric, ("MM-MLS", OWN), ("MM-MLS", rival), sign=sign)(rows)
            for rival in RIVALS
        }
        order = ("not reproduced", "in direction", "reproduced")
        flown = {rival: each for rival, each in found.items() if each != NOT_FLOWN}
        if not flown:
            return NOT_FLOWN
        rival = min(flown, key=lambda each: (order.index(flown[each][1]), each))
        missing = "" if len(flown) == len(RIVALS) else f"; {len(flown)} of {len(RIVALS)} rivals"
        figure, verdict = flown[rival]
        return f"{rival}: {figure}{missing}", verdict

    return judge


def _mostly(
    types: Collection[str], systems: Collection[str], map: str
) -> Callable[[Rows], Finding]:
    """Judge that most violations on a map are of some of the types I to V."""

    def judge(rows: Rows) -> Finding:
        flown = [row for each in systems for row in _of(rows, each, map=map).values()]
        by_type = [row_types(row) for row in flown]
        counts = [(sum(each[name] for name in types), sum(each.values())) for each in by_type]
        several = [each for each in counts if each[1]]
        if not several:
            return NOT_FLOWN
        own, every = (sum(each[place] for each in several) for place in (0, 1))
        holds = sum(2 * some > most for some, most in several)
        figure = f"{100 * own / every:.0f} % of them; in {holds} of {len(several)} searches"
        if 2 * own <= every:
            return figure, "not reproduced"
        return figure, "reproduced" if holds == len(several) else "in direction"

    return judge


def row_types(row: ResultRow) -> dict[str, int]:
    """Return the violations of a search by the paper's types."""
    counts = row.type_i, row.type_ii, row.type_iii, row.type_iv, row.type_v
    return dict(zip(("I", "II", "III", "IV", "V"), counts, strict=True))


def _all_types(rows: Rows) -> Finding:
    found = [row_types(row) for row in rows if row.method == OWN]
    if not found:
        return NOT_FLOWN
    counts = {name: sum(each[name] for each in found) for name in found[0]}
    figure = ", ".join(f"{name} {count}" for name, count in counts.items())
    return figure, "reproduced" if all(counts.values()) else "not reproduced"


def _only_with_the_agent(rows: Rows) -> Finding:
    """Judge that types IV and V are found by the agent that was trained in the surrogate alone."""
    others = [row for row in rows if row.method in RIVALS and row.method != AGENT_ALONE]
    if not others or not _of(rows, "MM-MLS"):
        return NOT_FLOWN
    counts = {
        method: sum(row.type_iv + row.type_v for row in others if row.method == method)
        for method in RIVALS
        if any(row.method == method for row in others)
    }
    figure = ", ".join(f"{method} {count}" for method, count in counts.items())
    return figure, "not reproduced" if any(counts.values()) else "reproduced"


def _near(rows: Rows) -> Finding:
    """Judge that the agent without the GA is nearer to the paper's method than `random` is."""
    own, alone, drawn = (_of(rows, "MM-MLS", each) for each in (OWN, AGENT_ALONE, "random"))
    keys = [key for key in own if key in alone and key in drawn]
    if not keys:
        return NOT_FLOWN
    gaps = [
        float(np.mean([ITS_CODE.value_of(own[key]) - ITS_CODE.value_of(each[key]) for key in keys]))
        for each in (alone, drawn)
    ]
    figure = f"{gaps[0]:+.1f} below, random {gaps[1]:+.1f} ({len(keys)} pairs)"
    return figure, "in direction" if abs(gaps[0]) < abs(gaps[1]) else "not reproduced"


def _hardly_above(rows: Rows) -> Finding:
    """Judge that the GA without RL is above random on the lawn, by no more than 2 points."""
    figure, verdict = _above(ITS_CODE, ("MM-MLS", "ga"), ("MM-MLS", "random"), map="lawn")(rows)
    if (figure, verdict) == NOT_FLOWN:
        return NOT_FLOWN
    mean = float(figure.split()[0])
    return figure, "in direction" if 0 < mean <= HARDLY_POINTS else "not reproduced"


def _as_long(rows: Rows) -> Finding:
    own = _of(rows, "MM-MLS")
    ratios = [
        HOURS.value_of(own[key]) / HOURS.value_of(row)
        for rival in RIVALS
        for key, row in _of(rows, "MM-MLS", rival).items()
        if key in own
    ]
    if not ratios:
        return NOT_FLOWN
    figure = f"{min(ratios):.2f} to {max(ratios):.2f} times ({len(ratios)} pairs)"
    return figure, "reproduced" if max(ratios) <= LONGER else "not reproduced"


def _system(name: str) -> tuple[str, str]:
    return name, OWN


CLAIMS = (
    Claim(
        text="RQ1: OpenCV-MLS fails more often than TPHYolo-MLS",
        judge=_above(ITS_CODE, _system("OpenCV-MLS"), _system("TPHYolo-MLS")),
    ),
    Claim(
        text="RQ1: TPHYolo-MLS fails more often than MM-MLS",
        judge=_above(ITS_CODE, _system("TPHYolo-MLS"), _system("MM-MLS")),
    ),
    Claim(
        text="RQ1: on the lawn most violations are collisions (III, IV)",
        judge=_mostly(("III", "IV"), ("OpenCV-MLS", "TPHYolo-MLS", "MM-MLS"), "lawn"),
    ),
    Claim(
        text="RQ1: on the court OpenCV-MLS mostly fails to detect (I, II)",
        judge=_mostly(("I", "II"), ("OpenCV-MLS",), "court"),
    ),
    Claim(text="RQ1: all types I to V occur", judge=_all_types),
    Claim(
        text="RQ2: GARL finds the most violations",
        judge=_above_all(ITS_CODE),
    ),
    Claim(
        text="RQ2: GARL finds ten the soonest",
        judge=_above_all(ITS_TOP10, sign=-1),
    ),
    Claim(
        text="RQ2: GARL's scenarios are the farthest from each other",
        judge=_above_all(WEATHER_DISTANCE),
    ),
    Claim(
        text="RQ2: GARL's violating flights cover the most",
        judge=_above_all(ITS_COVERAGE),
    ),
    Claim(
        text="RQ2: on the lawn the GA without RL is hardly better than random",
        judge=_hardly_above,
    ),
    Claim(
        text="RQ2: the agent without the GA comes near to GARL",
        judge=_near,
    ),
    Claim(
        text="RQ2: only GARL and the agent without the GA find types IV and V",
        judge=_only_with_the_agent,
    ),
    Claim(
        text="RQ2: a search of GARL lasts about as long as the others",
        judge=_as_long,
    ),
)


def claim_lines(rows: Rows) -> list[tuple[str, str, str]]:
    """Return a line for each claim: its text, what the rows say, and the verdict."""
    return [(each.text, *each.judge(rows)) for each in CLAIMS]
