"""Checkpoints of a training, and which training a checkpoint belongs to."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import pickle
from pathlib import Path

import torch

from pytest_garl.errors import GarlError
from pytest_garl.npcs.training.dqn import EpisodeRecord, Learner
from pytest_garl.npcs.training.presets import Surrogate, Training

_MEMORY = ("states", "afters", "actions", "sums", "discounts")


@functools.cache
def sources_sha256() -> str:
    """Return the hash of the code that a training depends on: adversary, simulation, scenarios."""
    digest = hashlib.sha256()
    package = Path(__file__).parents[2]
    for folder in ("npcs", "simulation", "scenarios"):
        for file in sorted((package / folder).rglob("*.py")):
            name = file.relative_to(package).as_posix()
            digest.update(name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


def identity_of(surrogate: Surrogate, training: Training) -> str:
    """Return a hash of everything that decides on the weights of a training."""
    maps = [map.sha256 for map in surrogate.maps]
    what = (sources_sha256(), dataclasses.replace(surrogate, maps=()), maps, training)
    return hashlib.sha256(repr(what).encode()).hexdigest()


def save_checkpoint(learner: Learner, path: Path, identity: str) -> None:
    """Write the state of a training; a process that dies meanwhile leaves the last one whole."""
    filled = min(learner.stored, learner.training.replay)
    path.parent.mkdir(parents=True, exist_ok=True)
    half = path.with_suffix(".part")
    torch.save(
        {
            "identity": identity,
            "network": learner.network.state_dict(),
            "target": learner.target.state_dict(),
            "optimiser": learner.optimiser.state_dict(),
            "updates": learner.updates,
            "stored": learner.stored,
            "rng": json.dumps(learner.rng.bit_generator.state),
            "history": json.dumps([dataclasses.astuple(record) for record in learner.history]),
            **{name: torch.from_numpy(getattr(learner, name)[:filled]) for name in _MEMORY},
        },
        half,
    )
    half.replace(path)


def restore_checkpoint(learner: Learner, path: Path, identity: str) -> None:
    """Bring a learner back to a saved state.

    Raises GarlError for a file that is damaged, or that belongs to another training.
    """
    try:
        kept = torch.load(path, weights_only=True)
        found = kept["identity"]
    except (OSError, EOFError, RuntimeError, LookupError, TypeError, pickle.PickleError) as error:
        raise GarlError(f"{path}: the checkpoint cannot be read ({error}); delete it") from error
    if found != identity:
        raise GarlError(
            f"{path}: the checkpoint belongs to another training; delete it, choose another "
            "folder, or train with the same options as before"
        )
    learner.network.load_state_dict(kept["network"])
    learner.target.load_state_dict(kept["target"])
    learner.optimiser.load_state_dict(kept["optimiser"])
    learner.updates, learner.stored = kept["updates"], kept["stored"]
    learner.rng.bit_generator.state = json.loads(kept["rng"])
    for name in _MEMORY:
        rows = kept[name].numpy()
        getattr(learner, name)[: len(rows)] = rows
    fields = [field.name for field in dataclasses.fields(EpisodeRecord)]
    learner.history = [
        EpisodeRecord(**dict(zip(fields, values, strict=True)))
        for values in json.loads(kept["history"])
    ]
