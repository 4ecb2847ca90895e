"""Learned and unlearned minds of NPCs that perceive the UAV in part, in the surrogate.

``python -m lab.minds`` compares them on the same episodes, which no training and no validation
used, and adds the rows that ``docs/minds.csv`` lacks; ``--report`` prints the table.
``interfering`` makes the policies of `lab.grades`.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import os
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from lab.table import Key, ResultTable, Row, run_study, share
from pytest_garl.npcs.interference import Interfering, Mind
from pytest_garl.npcs.learned import LearnedMind, shipped
from pytest_garl.npcs.minds import Direct, Intercepting, ToMarker
from pytest_garl.npcs.training.presets import Uav

SEEDS_FROM = 3_500_000_000
"""Beyond the seeds of training, validation and report."""
TABLE = ResultTable(
    file=Path("docs/minds.csv"),
    columns=("grade", "mind", "uav", "episodes", "collided"),
    key=("grade", "mind", "uav", "episodes"),
)
UNLEARNED: Mapping[str, Callable[[], Mind]] = {
    "direct": Direct,
    "intercepting": Intercepting,
    "to-marker": ToMarker,
}


def mind_of(grade: str, mind: str) -> Mind:
    """Return a mind by its name: ``learned``, an unlearned one, or the path of weights."""
    if mind in UNLEARNED:
        return UNLEARNED[mind]()
    return LearnedMind(shipped(grade) if mind == "learned" else mind)


def interfering(grade: str, mind: str) -> Interfering:
    """Return the NPC policy of a grade with a mind."""
    return Interfering(grade, mind_of(grade, mind))


def collisions(job: tuple[str, str, Uav, range]) -> int:
    """Return how many episodes end in a collision."""
    from pytest_garl.npcs.training.presets import PRESETS
    from pytest_garl.npcs.training.surrogate import GradedEnv
    from pytest_garl.scenarios.maps.loading import load_map

    grade, name, uav, seeds = job
    maps = tuple(load_map(each) for each in ("court", "lawn"))
    surrogate = dataclasses.replace(
        PRESETS[grade].surrogate,
        maps=maps,
        uav=uav,
    )
    env, mind, hits = GradedEnv(surrogate), mind_of(grade, name), 0
    for seed in seeds:
        _, info = env.reset(seed=seed)
        over = False
        while not over and env.belief is not None:
            _, _, over, _, info = env.follow(mind.decide(env.belief))
        hits += bool(info["collided"])
    env.close()
    return hits


def row_of(key: Key, pool: Executor) -> dict[str, Any]:
    """Fly the episodes of one row."""
    grade, mind, _, episodes = key
    uav: Uav = "avoiding" if key[2] == "avoiding" else "straight"
    count = int(episodes)
    seeds = (
        range(SEEDS_FROM, SEEDS_FROM + count // 2),
        range(SEEDS_FROM + count // 2, SEEDS_FROM + count),
    )
    hits = sum(pool.map(collisions, [(grade, mind, uav, each) for each in seeds]))
    return {**dict(zip(TABLE.key, key, strict=True)), "collided": hits}


def report(rows: list[Row]) -> str:
    """Return a Markdown table."""
    lines = ["| grade | mind | UAV | episodes | collided |", "| --- | --- | --- | ---: | --- |"]
    for row in rows:
        rate = share(int(row["collided"]), int(row["episodes"]))
        lines.append(
            f"| {row['grade']} | {row['mind']} | {row['uav']} | {row['episodes']} | {rate} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Fly the missing rows, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--episodes", type=int, default=200, help="per row; default 200")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    run_study(parser, TABLE, report, fly_rows)


def fly_rows(arguments: argparse.Namespace) -> None:
    """Fly the rows that the table lacks."""
    keys = itertools.product(
        ("curious", "chasing"),
        ("learned", *UNLEARNED),
        ("straight", "avoiding"),
        (str(arguments.episodes),),
    )
    TABLE.fly_missing(keys, row_of, arguments.workers)


if __name__ == "__main__":
    main()
