"""When an NPC begins: how much the moment is worth, and who decides it best.

``python -m lab.moments`` draws landings of the surrogate, with straight and avoiding UAVs of many
styles, finds out for each moment at which its NPC can begin how the landing ends, and writes a row
per decider to ``docs/moments.csv``; ``--report`` prints the tables.  Rules are tuned on the
landings from which the director that ships learned.  Everything is tested on landings that neither
a rule nor the director has seen.  It can be interrupted and started again at any time.
"""

from __future__ import annotations

import argparse
import dataclasses
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lab.table import ResultTable, Row, run_study, share
from pytest_garl import cpu_dispatch
from pytest_garl.npcs.director import (
    AT,
    FEATURES,
    SCALE_M,
    WAITING,
    Director,
    Features,
    LearnedDirector,
    TimeToGo,
)
from pytest_garl.npcs.gradient import untrained
from pytest_garl.npcs.learned import Network, learned_director
from pytest_garl.npcs.training.counterfactuals import (
    COLLIDED,
    PREVENTABLE,
    STRIDE,
    MomentTable,
)
from pytest_garl.npcs.training.director_training import (
    begin_of,
    deep_q_network,
    table_folder,
    tables_of,
)
from pytest_garl.npcs.training.presets import PRESETS
from pytest_garl.npcs.training.selection import REPORT_SEEDS_FROM
from pytest_garl.scenarios.groups import DESCENT
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.story import STORY
from pytest_garl.simulation.npc_policy import DECISION_STEP_S

PRESET = PRESETS["director"]
MAPS = ("court", "lawn")
TESTED_FROM, TESTED = REPORT_SEEDS_FROM + 120, 120
"""Landings of the table; those before them were looked at while the director was built."""
SEED = 5100
"""Of the begins as genes, and of the untrained network; no training and no other study uses it."""
REWARDS = {"any collision": COLLIDED, "preventable collision": PREVENTABLE}
"""What a rule is tuned for: the end that counts, and those above it."""
DELAYS_S = np.arange(0.0, 16.0, 0.5)
HEIGHTS_M = np.arange(0.5, 9.0, 0.5)
MARGINS_S = np.arange(-3.0, 8.1, 0.5)
UNSEEN_S = np.arange(0.0, 6.1, 0.5)
UAVS = ("straight", "avoiding")
TABLE = ResultTable(
    file=Path("docs/moments.csv"),
    columns=(
        "tuned_for",
        "decider",
        "constants",
        "grade",
        "uav",
        "landings",
        "collided",
        "preventable",
    ),
    key=("tuned_for", "decider", "grade", "uav"),
)
Begins = Callable[[MomentTable], int | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class AtHeight:
    """Goes when the NPC believes the UAV above the marker to be lower than a height."""

    height_m: float

    def decides(self, features: Features) -> bool:
        """Return whether the NPC goes now."""
        is_near = features[AT["uav_from_marker"]] * SCALE_M <= 3.0
        return bool(
            features[AT["sees"]] and is_near and features[AT["height"]] * SCALE_M <= self.height_m
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Decider:
    """One row: who decides, with which constants, and when an NPC begins in a landing."""

    name: str
    begins: Begins
    constants: str = ""


def as_gene(table: MomentTable) -> int | None:
    """Return a begin as a search draws it: a moment of the descent and a delay after it."""
    rng = np.random.default_rng((SEED, table.seed))
    phase = int(rng.integers(len(DESCENT)))
    begins_s = table.descent_s[phase] + float(rng.uniform(*STORY["delay_s"].draws))
    number = np.ceil(begins_s / DECISION_STEP_S - 1e-9)
    return int(number) if number < len(table.features) else None


def first_sight(table: MomentTable) -> int:
    """Return the first decision at which the NPC sees the UAV; the start if it never does."""
    return int(table.features[:, AT["sees"]].argmax())


def after_sight(delay_s: float) -> Begins:
    """Return a rule that goes a time after the first sight."""

    def begins(table: MomentTable) -> int | None:
        number = first_sight(table) + round(delay_s / DECISION_STEP_S)
        return number if number < len(table.features) else None

    return begins


def decided_by(director: Director) -> Begins:
    """Return when a director lets the NPC begin."""
    return lambda table: begin_of(director, table)


def best(least: int) -> Begins:
    """Return the rule that knows how each landing ends."""

    def begins(table: MomentTable) -> int | None:
        found = np.flatnonzero(table.ends >= least)
        return int(found[0]) * STRIDE if len(found) else None

    return begins


def hits(begins: Begins, tables: Iterable[MomentTable], least: int) -> int:
    """Return how many landings end with what counts."""
    return sum(table.end_of(begins(table)) >= least for table in tables)


def tuned(rules: Iterable[Decider], tables: Sequence[MomentTable], least: int) -> Decider:
    """Return the rule with the most hits, of equals the first."""
    return max(rules, key=lambda rule: hits(rule.begins, tables, least))


def deciders(tables: Sequence[MomentTable], least: int, rival: Network) -> Iterator[Decider]:
    """Yield all deciders, the rules tuned on tables; ``rival`` is a network that decides."""
    yield Decider(name="a gene, as the domain field draws it", begins=as_gene)
    yield Decider(name="at the first sight", begins=first_sight)
    network = untrained(WAITING, (len(FEATURES), 24, 24, 2), SEED)
    yield Decider(name="an untrained network", begins=decided_by(LearnedDirector(network=network)))
    yield tuned(
        (
            Decider(
                name="a delay after the first sight",
                begins=after_sight(delay_s),
                constants=f"{delay_s:g} s",
            )
            for delay_s in DELAYS_S.tolist()
        ),
        tables,
        least,
    )
    yield tuned(
        (
            Decider(
                name="a height of the UAV",
                begins=decided_by(AtHeight(height_m=height_m)),
                constants=f"{height_m:g} m",
            )
            for height_m in HEIGHTS_M.tolist()
        ),
        tables,
        least,
    )
    unseen = tuned((_time_to_go(0.0, unseen_s) for unseen_s in UNSEEN_S.tolist()), tables, least)
    seconds = float(unseen.constants.split()[-2])
    yield tuned((_time_to_go(each, seconds) for each in MARGINS_S.tolist()), tables, least)
    yield Decider(
        name="double Q-learning on the same landings",
        begins=decided_by(LearnedDirector(network=rival)),
    )
    yield Decider(name="the director that ships", begins=decided_by(learned_director()))
    yield Decider(name="whoever knows the end", begins=best(least))


def _time_to_go(margin_s: float, unseen_s: float) -> Decider:
    return Decider(
        name="time to go",
        begins=decided_by(TimeToGo(margin_s=margin_s, unseen_s=unseen_s)),
        constants=f"margin {margin_s:g} s; unseen {unseen_s:g} s",
    )


def rows_of(learned: Sequence[MomentTable], tested: Sequence[MomentTable]) -> Iterator[Row]:
    """Yield the rows of the table."""
    rival = deep_q_network(learned, PRESET.training)
    for tuned_for, least in REWARDS.items():
        for decider in deciders(learned, least, rival):
            for grade in sorted(set(PRESET.surrogate.grades)):
                for uav in UAVS:
                    part = [each for each in tested if (each.grade, each.uav) == (grade, uav)]
                    ends = [each.end_of(decider.begins(each)) for each in part]
                    yield {
                        "tuned_for": tuned_for,
                        "decider": decider.name,
                        "constants": decider.constants,
                        "grade": grade,
                        "uav": uav,
                        "landings": str(len(ends)),
                        "collided": str(sum(end >= COLLIDED for end in ends)),
                        "preventable": str(sum(end >= PREVENTABLE for end in ends)),
                    }


def report(rows: list[Row]) -> str:
    """Return a table for each reward, of NPCs that chase."""
    lines = []
    for tuned_for in REWARDS:
        lines += [
            f"Tuned for: {tuned_for}.",
            "",
            "| who decides | constants | landings | collided | preventable | straight / avoiding |",
            "| --- | --- | ---: | --- | --- | --- |",
        ]
        own = [row for row in rows if (row["tuned_for"], row["grade"]) == (tuned_for, "chasing")]
        for name in dict.fromkeys(row["decider"] for row in own):
            part = [row for row in own if row["decider"] == name]
            landings, collided, preventable = (
                sum(int(row[key]) for row in part)
                for key in ("landings", "collided", "preventable")
            )
            each = " / ".join(row["preventable"] for row in part)
            lines.append(
                f"| {name} | {part[0]['constants']} | {landings} | {share(collided, landings)} "
                f"| {share(preventable, landings)} | {each} |"
            )
        lines.append("")
    return "\n".join(lines).rstrip()


def fly(arguments: argparse.Namespace) -> None:
    """Fly the landings that are missing, and write the table anew."""
    cpu_dispatch.pin()
    maps = tuple(load_map(name) for name in MAPS)
    surrogate = dataclasses.replace(PRESET.surrogate, maps=maps)
    folder = table_folder(surrogate, arguments.folder)
    learned = tables_of(surrogate, range(PRESET.training.episodes), folder, arguments.processes)
    tested = tables_of(
        surrogate,
        range(TESTED_FROM, TESTED_FROM + TESTED),
        folder,
        arguments.processes,
    )
    TABLE.file.unlink(missing_ok=True)
    TABLE.append(rows_of(learned, tested))


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=Path(".garl/train"), help="of the landings")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    run_study(parser, TABLE, report, fly)


if __name__ == "__main__":
    main()
