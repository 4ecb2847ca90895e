"""Trains the director on tables of counterfactual moments, and keeps the best of several seeds.

A table knows how the landing ends for each moment, and so what each decision is worth: learning
follows the gradient of the expected worth itself, without samples, exploration or bootstrapping.
It needs no torch and starts from the best rule.
"""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from pytest_garl.npcs.director import WAITING, Director, LearnedDirector, TimeToGo
from pytest_garl.npcs.gradient import (
    Stopping,
    StoppingRate,
    learned_when_to_go,
    untrained,
)
from pytest_garl.npcs.learned import SHAPES, Network, save
from pytest_garl.npcs.training.checkpoint import sources_sha256
from pytest_garl.npcs.training.counterfactuals import (
    COLLIDED,
    PREVENTABLE,
    WORTH,
    MomentTable,
    drawn_table,
)
from pytest_garl.npcs.training.presets import Surrogate
from pytest_garl.npcs.training.selection import (
    CHOICE_SEEDS_FROM,
    REPORT_SEEDS_FROM,
    MomentScore,
    TrainingPlan,
    TrainingResult,
    versions,
)

HIDDEN = (24, 24)
MARGINS_S = tuple(number / 2 for number in range(-6, 13))
UNSEEN_S = tuple(float(number) for number in range(4))
"""The constants of the rule among which the best are chosen."""


def begin_of(director: Director, table: MomentTable) -> int | None:
    """Return at which decision an NPC begins, None for never."""
    goes = (number for number, row in enumerate(table.features) if director.decides(row))
    return next(goes, None)


def score_of(director: Director, tables: Sequence[MomentTable]) -> MomentScore:
    """Return how landings end if a director decides."""
    ends = [table.end_of(begin_of(director, table)) for table in tables]
    return MomentScore(
        episodes=len(ends),
        collided=sum(end >= COLLIDED for end in ends),
        preventable=sum(end == PREVENTABLE for end in ends),
    )


def stopping_of(table: MomentTable) -> Stopping:
    """Return a table as what each decision is worth."""
    numbers = range(len(table.features))
    return Stopping(
        states=table.features,
        go=np.array([WORTH.get(table.end_of(number), 0.0) for number in numbers]),
        never=WORTH.get(table.end_of(None), 0.0),
    )


def best_rule(tables: Sequence[MomentTable]) -> TimeToGo:
    """Return the rule with the constants that are worth most on tables, of equals the first."""
    rules = [
        TimeToGo(margin_s=margin_s, unseen_s=unseen_s)
        for margin_s, unseen_s in itertools.product(MARGINS_S, UNSEEN_S)
    ]
    return max(rules, key=lambda rule: score_of(rule, tables).rate)


def train_network(tables: Sequence[MomentTable], settings: StoppingRate, seed: int) -> Network:
    """Return a network that learned on tables, from the best rule on."""
    rule = best_rule(tables)
    goes = [float(rule.decides(row)) for table in tables for row in table.features]
    inputs, actions = SHAPES[WAITING]
    network = untrained(WAITING, (inputs, *HIDDEN, actions), seed)
    things = [stopping_of(table) for table in tables]
    return learned_when_to_go(network, things, np.array(goes), settings)


def tables_of(
    surrogate: Surrogate, seeds: Sequence[int], folder: Path, processes: int = 1
) -> list[MomentTable]:
    """Return the tables of the landings that seeds draw; a folder keeps them."""
    jobs = [(surrogate, seed, folder) for seed in seeds]
    if processes > 1:
        with ProcessPoolExecutor(processes) as pool:
            return list(pool.map(drawn_table, *zip(*jobs, strict=True)))
    return list(itertools.starmap(drawn_table, jobs))


def table_folder(surrogate: Surrogate, folder: Path) -> Path:
    """Return where the tables of a surrogate are kept: another place for other sources."""
    maps = [map.sha256 for map in surrogate.maps]
    what = (sources_sha256(), dataclasses.replace(surrogate, maps=()), maps)
    return folder / f"moments-{hashlib.sha256(repr(what).encode()).hexdigest()[:12]}"


def train_director(
    plan: TrainingPlan, on_validation: Callable[[int, float], None] = lambda seed, rate: None
) -> TrainingResult:
    """Fly the tables, train every seed on them, and write the best weights and their manifest.

    Each seed learns from the same landings, whose number is that of the episodes.  An interrupted
    call continues from the tables in the plan's folder.
    """
    folder = table_folder(plan.surrogate, plan.folder)
    starts = (0, CHOICE_SEEDS_FROM, REPORT_SEEDS_FROM)
    counts = (plan.training.episodes, plan.validation, plan.validation)
    learned, chosen, reported = (
        tables_of(plan.surrogate, range(start, start + count), folder, plan.processes)
        for start, count in zip(starts, counts, strict=True)
    )
    networks, scores = {}, {}
    for seed in plan.seeds:
        networks[seed] = train_network(learned, StoppingRate(), seed)
        scores[seed] = score_of(LearnedDirector(network=networks[seed]), chosen)
        on_validation(seed, scores[seed].rate)
    best = max(plan.seeds, key=lambda seed: (scores[seed].rate, -seed))
    report = score_of(LearnedDirector(network=networks[best]), reported)
    save(plan.out, networks[best], _manifest(plan, best, scores, report))
    return TrainingResult(
        best=best, rates={seed: score.rate for seed, score in scores.items()}, report=report
    )


def _manifest(
    plan: TrainingPlan, best: int, scores: Mapping[int, MomentScore], report: MomentScore
) -> dict[str, Any]:
    surrogate = plan.surrogate
    return {
        "policy": plan.name,
        "seed": best,
        "training": {
            "seed": best,
            "episodes": plan.training.episodes,
            "hidden": list(HIDDEN),
            **dataclasses.asdict(StoppingRate()),
        },
        "worth": {"collision": WORTH[COLLIDED], "preventable": WORTH[PREVENTABLE]},
        "surrogate": {
            "maps": {map.name: map.sha256 for map in surrogate.maps},
            "types": list(surrogate.types),
            "uav": surrogate.uav,
            "grades": list(surrogate.grades),
            "takes_off": surrogate.takes_off,
            "airframe": dataclasses.asdict(surrogate.airframe),
        },
        "validation": {str(seed): dataclasses.asdict(score) for seed, score in scores.items()},
        "other_episodes": dataclasses.asdict(report),
        "sources": sources_sha256(),
        "versions": versions(),
    }
