"""Goals: by how much a method should be better than random search and its rivals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from lab.experiment.metrics import (
    CAUSES,
    COVERAGE,
    DISTANCE,
    PAPER,
    TOP10,
    VIOLATIONS,
    MethodSearches,
    Metric,
    searches_of_method,
)
from lab.experiment.results import ResultRow
from lab.experiment.spec import Experiment, Goals
from lab.experiment.tables import NOT_RUN, markdown

GoalStatus = Literal["met", "missed", "not run"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """A metric should be ``factor`` times that of random search, or better than every baseline's.

    If ``factor`` is None, the metric should be strictly better than that of every baseline.  If
    ``less`` is true, less is better, and ``factor`` is the largest allowed ratio.
    """

    metric: Metric
    factor: float | None = None
    less: bool = False

    @property
    def text(self) -> str:
        """The goal in words, which stand after the metric's title; "chance" is random search."""
        if self.factor is None:
            return "below every baseline" if self.less else "above every baseline"
        return f"at {'most' if self.less else 'least'} {self.factor:g} × chance"

    def holds(self, own: float, other: float) -> bool:
        """Whether the method's mean ``own`` reaches the goal against the mean of another method."""
        if self.factor is None:
            return own < other if self.less else own > other
        wanted = self.factor * other
        return own <= wanted if self.less else own >= wanted


GOALS = (
    Goal(metric=VIOLATIONS, factor=2.0),
    Goal(metric=VIOLATIONS),
    Goal(metric=PAPER, factor=2.0),
    Goal(metric=PAPER),
    Goal(metric=TOP10, factor=0.5, less=True),
    Goal(metric=TOP10, less=True),
    Goal(metric=DISTANCE, factor=1.2),
    Goal(metric=COVERAGE, factor=2.0),
    Goal(metric=CAUSES),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalResult:
    """A goal on one map: whether it is met, with the means of the method and of the others."""

    goal: Goal
    map: str
    status: GoalStatus
    own: str
    others: str


def goal_results(
    experiment: Experiment, goals: Goals, rows: Sequence[ResultRow]
) -> list[GoalResult]:
    """Return the results of all goals on all maps.

    Two methods are compared by their means over the seeds that both have flown, if their rows count
    violations by one definition.  A goal is missed if one rival is not beaten.  If all rivals are
    beaten but one was not run, the goal is open.
    """

    def searches(map: str, method: str) -> MethodSearches:
        return searches_of_method(experiment, rows, goals.seeds, goals.system, map, method)

    return [
        _goal_result(
            goal,
            searches(map, goals.method),
            [
                searches(map, method)
                for method in ((goals.random,) if goal.factor is not None else goals.baselines)
            ],
        )
        for map in goals.maps
        for goal in GOALS
    ]


def _goal_result(goal: Goal, own: MethodSearches, others: Sequence[MethodSearches]) -> GoalResult:
    reached: list[bool | None] = []
    texts = []
    for other in others:
        common = sorted({*own.seeds} & {*other.seeds})
        if not common:
            reached.append(None)
            texts.append(f"{other.method} {NOT_RUN}")
            continue
        if len({*own.definitions, *other.definitions}) > 1:
            reached.append(None)
            texts.append(f"{other.method} of another definition")
            continue
        other_mean = other.mean(goal.metric, common)
        reached.append(goal.holds(own.mean(goal.metric, common), other_mean))
        text = f"{other.method} {mean_text(other, goal.metric, common)}"
        if common != sorted(own.seeds):
            text += f" (to {mean_text(own, goal.metric, common)})"
        texts.append(text)
    status: GoalStatus = "met"
    if False in reached:
        status = "missed"
    elif None in reached:
        status = "not run"
    return GoalResult(
        goal=goal,
        map=own.map,
        status=status,
        own=mean_text(own, goal.metric, own.seeds) if own.rows else NOT_RUN,
        others=", ".join(texts),
    )


def mean_text(searches: MethodSearches, metric: Metric, seeds: Sequence[int]) -> str:
    """Return a mean, with "≥" if a search found fewer than ten violations."""
    open_ended = metric is TOP10 and any(
        row.top10 is None for row in searches.rows if row.seed in seeds
    )
    return f"{'≥ ' * open_ended}{searches.mean(metric, seeds):.{metric.digits}f}"


def table(results: Sequence[GoalResult], method: str) -> str:
    """Return the goals as a Markdown table."""
    header = ("map", "figure", "wanted", "", method, "others")
    lines = [
        [
            each.map,
            each.goal.metric.title,
            each.goal.text,
            f"**{each.status}**",
            each.own,
            each.others,
        ]
        for each in results
    ]
    return markdown(header, lines)
