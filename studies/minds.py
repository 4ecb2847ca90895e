"""Learned and unlearned minds of NPCs that perceive the UAV in part, in the surrogate.

``python -m studies.minds`` compares them on the same episodes, which no training and no validation
used, and writes ``docs/minds.csv``.  ``interfering`` makes the policies of `studies.grades`.
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from pytest_garl.adversary.interference import Interfering, Mind
from pytest_garl.adversary.learned import LearnedMind, shipped
from pytest_garl.adversary.minds import Direct, Intercepting, ToMarker
from studies.table import share

SEEDS_FROM = 3_500_000_000
"""Beyond the seeds of training, validation and report."""
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


def collisions(job: tuple[str, str, str, range]) -> int:
    """Return how many episodes end in a collision."""
    from pytest_garl.adversary.training.graded import GradedEnv
    from pytest_garl.adversary.training.presets import PRESETS
    from pytest_garl.scenarios.maps.map import load_map

    grade, name, uav, seeds = job
    maps = tuple(load_map(each) for each in ("court", "lawn"))
    surrogate = dataclasses.replace(
        PRESETS[grade].surrogate,
        maps=maps,
        uav=uav,  # type: ignore[arg-type]
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


def main() -> None:
    """Fly all minds and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--episodes", type=int, default=300)
    parser.add_argument("--grades", nargs="+", default=["curious", "chasing"])
    parser.add_argument("--minds", nargs="+", default=["learned", *UNLEARNED])
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("docs/minds.csv"))
    arguments = parser.parse_args()
    half = arguments.episodes // 2
    seeds = (
        range(SEEDS_FROM, SEEDS_FROM + half),
        range(SEEDS_FROM + half, SEEDS_FROM + arguments.episodes),
    )
    rows = []
    with ProcessPoolExecutor(arguments.workers) as pool:
        for grade in arguments.grades:
            for mind in arguments.minds:
                for uav in ("straight", "avoiding"):
                    hits = sum(pool.map(collisions, [(grade, mind, uav, each) for each in seeds]))
                    rows.append((grade, mind, uav, arguments.episodes, hits))
                    print(*rows[-1], share(hits, arguments.episodes), flush=True)
    with arguments.out.open("w", newline="") as file:
        csv.writer(file).writerows([("grade", "mind", "uav", "episodes", "collided"), *rows])


if __name__ == "__main__":
    main()
