"""Whether a method is as much better than chance and its rivals as it is meant to be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from pytest_garl.experiments.metrics import (
    COVERAGE,
    DISTANCE,
    SIGNATURES,
    TOP10,
    VIOLATIONS,
    Figure,
    Sample,
    sample,
)
from pytest_garl.experiments.results import Row
from pytest_garl.experiments.spec import Experiment, Goals
from pytest_garl.experiments.tables import NOT_RUN, markdown

Verdict = Literal["met", "missed", "not run"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """A wish: a figure at least ``factor`` times chance's, or better than every baseline's.

    ``factor`` None: strictly better than all baselines.  Where less is better it is the share of
    chance's figure that may not be exceeded.
    """

    figure: Figure
    factor: float | None = None
    less: bool = False

    @property
    def wish(self) -> str:
        """The wish in words, after the figure's title."""
        if self.factor is None:
            return "below every baseline" if self.less else "above every baseline"
        return f"at {'most' if self.less else 'least'} {self.factor:g} × chance"

    def holds(self, own: float, other: float) -> bool:
        """Whether a mean is as much better than another's as is wished."""
        if self.factor is None:
            return own < other if self.less else own > other
        wanted = self.factor * other
        return own <= wanted if self.less else own >= wanted


GOALS = (
    Goal(figure=VIOLATIONS, factor=2.0),
    Goal(figure=VIOLATIONS),
    Goal(figure=TOP10, factor=0.5, less=True),
    Goal(figure=TOP10, less=True),
    Goal(figure=DISTANCE, factor=1.2),
    Goal(figure=COVERAGE, factor=2.0),
    Goal(figure=SIGNATURES),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """What became of a goal on a map, with the figures."""

    goal: Goal
    map: str
    verdict: Verdict
    own: str
    others: str


def judged(experiment: Experiment, goals: Goals, rows: Sequence[Row]) -> list[Judged]:
    """Return all goals on all maps.

    Methods are compared by their means over the seeds that both have flown.  One rival that is not
    beaten is enough to miss; a rival that was not run leaves open what would else be met.
    """

    def of(map: str, method: str) -> Sample:
        return sample(experiment, rows, goals.seeds, goals.system, map, method)

    return [
        _judge(
            goal,
            of(map, goals.method),
            [
                of(map, method)
                for method in ((goals.random,) if goal.factor is not None else goals.baselines)
            ],
        )
        for map in goals.maps
        for goal in GOALS
    ]


def _judge(goal: Goal, own: Sample, others: Sequence[Sample]) -> Judged:
    answers: list[bool | None] = []
    words = []
    for other in others:
        common = sorted({*own.seeds} & {*other.seeds})
        if not common:
            answers.append(None)
            words.append(f"{other.method} {NOT_RUN}")
            continue
        theirs = other.mean(goal.figure, common)
        answers.append(goal.holds(own.mean(goal.figure, common), theirs))
        text = f"{other.method} {mean_text(other, goal.figure, common)}"
        if common != sorted(own.seeds):
            text += f" (to {mean_text(own, goal.figure, common)})"
        words.append(text)
    verdict: Verdict = "met"
    if False in answers:
        verdict = "missed"
    elif None in answers:
        verdict = "not run"
    return Judged(
        goal=goal,
        map=own.map,
        verdict=verdict,
        own=mean_text(own, goal.figure, own.seeds) if own.rows else NOT_RUN,
        others=", ".join(words),
    )


def mean_text(each: Sample, figure: Figure, seeds: Sequence[int]) -> str:
    """Return a mean; with "≥" where a search never had its tenth violation."""
    open_ended = figure is TOP10 and any(
        row.top10 is None for row in each.rows if row.seed in seeds
    )
    return f"{'≥ ' * open_ended}{each.mean(figure, seeds):.{figure.digits}f}"


def table(found: Sequence[Judged], method: str) -> str:
    """Return the goals as a Markdown table."""
    header = ("map", "figure", "wanted", "", method, "others")
    lines = [
        [
            each.map,
            each.goal.figure.title,
            each.goal.wish,
            f"**{each.verdict}**",
            each.own,
            each.others,
        ]
        for each in found
    ]
    return markdown(header, lines)
