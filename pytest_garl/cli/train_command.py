"""``garl train``: train the NPC policy, which moves people, dogs and birds."""

from __future__ import annotations

import dataclasses
import importlib
import os
import sys
from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import click

from pytest_garl import cpu_dispatch
from pytest_garl.errors import GarlError
from pytest_garl.landing_system import Airframe, airframe_of
from pytest_garl.npcs.director import WAITING
from pytest_garl.npcs.policy_catalogue import DEFAULT_POLICY
from pytest_garl.npcs.training.presets import PRESETS, Preset, Reward, Uav
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.story import GRADES

if TYPE_CHECKING:
    from pytest_garl.npcs.training.selection import TrainingPlan

RECENT_EPISODES = 50
"""Number of episodes over which the progress bar averages."""


@click.command()
@click.option(
    "--policy",
    type=click.Choice(list(PRESETS)),
    default=DEFAULT_POLICY,
    show_default=True,
    help=" ".join(f"{name} learns {preset.help}." for name, preset in PRESETS.items()),
)
@click.option(
    "--grade",
    "grades",
    type=click.Choice(GRADES[1:]),
    multiple=True,
    help="Train for a grade of behaviour: NPCs that perceive the UAV within its limits. The same "
    "as --policy with the grade's name; hostile NPCs are moved by dqn. Given twice, one network "
    "learns for both grades.",
)
@click.option(
    "--map",
    "maps",
    default="court,lawn",
    show_default=True,
    help="Maps to train on, separated by commas; your own are in scenarios/maps/.",
)
@click.option(
    "--type",
    "types",
    help="Types of NPCs that the policy moves, separated by commas (default: those of --policy).",
)
@click.option(
    "--system",
    metavar="MODULE:CLASS",
    help="Landing system whose airframe the surrogate's UAV has (default: a Matrice 100).",
)
@click.option(
    "--state",
    type=click.Choice(["paper", "extended", "relative"]),
    help="Input of the network, instead of that of --policy: the paper's four numbers, nine with "
    "the paper's actions, or ten in the NPC's own frame.",
)
@click.option(
    "--uav",
    type=click.Choice(get_args(Uav)),
    help="The UAV to learn against, instead of that of --policy.",
)
@click.option(
    "--reward",
    type=click.Choice(get_args(Reward)),
    help="The reward, instead of that of --policy.",
)
@click.option(
    "--episodes",
    type=click.IntRange(1),
    help="Per training (default: 800; the director learns from each moment of 160 landings).",
)
@click.option(
    "--seeds",
    type=click.IntRange(1),
    default=5,
    show_default=True,
    help="Number of trainings, each from its own seed; the best in validation is kept.",
)
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="First seed.")
@click.option(
    "--validation",
    type=click.IntRange(1),
    default=200,
    show_default=True,
    help="Episodes on which the trained policies are compared.",
)
@click.option(
    "--folder",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path(".garl/train"),
    show_default=True,
    help="Folder of checkpoints and curves; an interrupted training continues from there.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    default=Path("policy.npz"),
    show_default=True,
    help="File for the best weights; the manifest (.json) and the curve (.png) are written beside "
    "it.",
)
def train(**options: Any) -> None:
    """Train an NPC policy and write its weights.

    It learns in the surrogate, a landing on the project's own simulator: one NPC, a marker at a
    fixed place, and a UAV that knows the place. A seed takes about five minutes on two cores.
    """
    if options["out"].suffix != ".npz":
        raise GarlError(f"--out: found {str(options['out'])!r}, expected a name that ends in .npz")
    try:
        from pytest_garl.npcs.training.director_training import train_director
        from pytest_garl.npcs.training.selection import train_best
    except ImportError as error:
        raise GarlError(
            f"training needs packages that flying does not need ({error}): "
            "pip install 'pytest-garl[train]'"
        ) from error
    cpu_dispatch.check()
    plan = _plan(options)
    decides_when = plan.surrogate.state == WAITING
    with _Progress(plan) as progress:
        if decides_when:
            result = train_director(plan, progress.on_validation)
        else:
            result = train_best(plan, progress.on_episode, progress.on_validation)
    rates = ", ".join(f"seed {seed}: {100 * rate:.0f} %" for seed, rate in result.rates.items())
    what = "reward" if decides_when else "collisions"
    click.echo(f"{what} in {plan.validation} validation episodes: {rates}")
    click.echo(
        f"kept seed {result.best}: {100 * result.report.rate:.0f} % in {plan.validation} other "
        f"episodes; {plan.out} (with {plan.out.with_suffix('.json').name})"
    )


def _plan(options: dict[str, Any]) -> TrainingPlan:
    from pytest_garl.npcs.training.selection import TrainingPlan
    from pytest_garl.scenarios.maps.loading import load_map

    name, preset = _preset(options["policy"], options["grades"])
    if preset.surrogate.grades and (options["state"] or options["reward"]):
        raise GarlError(
            "--state and --reward are those of dqn and dqn-paper; NPCs of a grade learn from what "
            "they perceive, to collide"
        )
    types = _names(options["types"]) if options["types"] else preset.surrogate.types
    for type_name in types:
        if type_name not in OBJECT_TYPES:
            raise GarlError(
                f"--type: found {type_name!r}, expected some of {', '.join(OBJECT_TYPES)}"
            )
    overrides = {name: options[name] for name in ("state", "uav", "reward") if options[name]}
    folders = (Path.cwd() / "scenarios" / "maps",)
    return TrainingPlan(
        name=name,
        surrogate=dataclasses.replace(
            preset.surrogate,
            maps=tuple(load_map(name, folders) for name in _names(options["maps"])),
            types=types,
            airframe=_airframe(options["system"]),
            **overrides,
        ),
        training=dataclasses.replace(
            preset.training, episodes=options["episodes"] or preset.training.episodes
        ),
        seeds=tuple(range(options["seed"], options["seed"] + options["seeds"])),
        validation=options["validation"],
        folder=options["folder"],
        out=options["out"],
        processes=os.cpu_count() or 1,
    )


def _preset(policy: str, grades: tuple[str, ...]) -> tuple[str, Preset]:
    """Return the name and the preset of the policy to train."""
    if not grades:
        return policy, PRESETS[policy]
    if len(grades) == 1:
        name = "dqn" if grades[0] == "hostile" else grades[0]
        return name, PRESETS[name]
    if "hostile" in grades:
        raise GarlError(
            "--grade: found hostile beside another grade; its NPCs perceive everything, so they "
            "have a network of their own"
        )
    preset = PRESETS[grades[0]]
    surrogate = dataclasses.replace(preset.surrogate, grades=grades)
    return "-".join(grades), dataclasses.replace(preset, surrogate=surrogate)


def _names(text: str) -> tuple[str, ...]:
    names = tuple(part.strip() for part in text.split(",") if part.strip())
    if not names:
        raise GarlError(f"found {text!r}, expected names separated by commas")
    return names


def _airframe(reference: str | None) -> Airframe:
    if not reference:
        return Airframe()
    module, _, name = reference.partition(":")
    sys.path.insert(0, str(Path.cwd()))
    try:
        system = getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise GarlError(
            f"--system: found {reference!r}, which cannot be loaded ({error}); "
            "expected MODULE:CLASS of a landing system"
        ) from error
    # The surrogate's UAV is flown by the simple flight control.
    return dataclasses.replace(airframe_of(system), control_rate_hz=None)


class _Progress:
    """One progress bar per seed, with the mean reward and the collision rate of recent episodes."""

    def __init__(self, plan: TrainingPlan) -> None:
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeRemainingColumn,
        )

        self._plan = plan
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=20),
            MofNCompleteColumn(),
            TextColumn("{task.fields[note]}"),
            TimeRemainingColumn(elapsed_when_finished=True),
        )
        self._tasks: dict[int, Any] = {}
        self._recent: deque[Any] = deque(maxlen=RECENT_EPISODES)

    def __enter__(self) -> _Progress:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def on_episode(self, seed: int, record: Any) -> None:
        """Show the result of an episode."""
        if seed not in self._tasks:
            self._recent.clear()
            self._tasks[seed] = self._bar.add_task(
                f"seed {seed}", total=self._plan.training.episodes, note=""
            )
        self._recent.append(record)
        reward = sum(each.reward for each in self._recent) / len(self._recent)
        hits = sum(each.collided for each in self._recent) / len(self._recent)
        note = f"reward {reward:.2f}, collisions {100 * hits:.0f} %"
        self._bar.update(self._tasks[seed], completed=record.episode + 1, note=note)

    def on_validation(self, seed: int, rate: float) -> None:
        """Show the result of a trained policy in validation."""
        what = "reward" if self._plan.surrogate.state == WAITING else "collisions"
        note = f"validated: {what} {100 * rate:.0f} %"
        done = self._plan.training.episodes
        if seed not in self._tasks:
            self._tasks[seed] = self._bar.add_task(f"seed {seed}", total=done, note="")
        self._bar.update(self._tasks[seed], completed=done, note=note)
