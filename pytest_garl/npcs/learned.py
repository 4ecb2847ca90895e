"""Learned NPC policies: a small network in NumPy, its weights in a file, and their manifest."""

from __future__ import annotations

import base64
import functools
import hashlib
import io
import itertools
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_garl.errors import PolicyError
from pytest_garl.files.arrays import unpack
from pytest_garl.files.json_values import parse_json
from pytest_garl.files.user_files import MEGABYTE, read_bytes
from pytest_garl.messages import listed, shown
from pytest_garl.npcs.director import FEATURES, WAITING, LearnedDirector
from pytest_garl.npcs.encodings import ENCODINGS, on_turn
from pytest_garl.npcs.event_watch import EVENT_INPUTS, STRIKING
from pytest_garl.npcs.grades import GRADE_LIMITS
from pytest_garl.npcs.interference import Belief, Interfering
from pytest_garl.npcs.weights import WEIGHTS
from pytest_garl.simulation.npc_policy import STAY, Move, PolicySpec, Situation

Array = NDArray[np.float64]
FORMAT = 1
SHAPES: Mapping[str, tuple[int, int]] = {
    **{name: (each.size, each.actions) for name, each in ENCODINGS.items()},
    WAITING: (len(FEATURES), 2),
    STRIKING: (EVENT_INPUTS, 2),
}
"""How many inputs and actions a network has, by the name of its input."""
DIRECTOR = WEIGHTS / "grades" / "director.npz"
"""The weights of the director that ships."""
_LARGEST = MEGABYTE
"""Bytes of weights, packed or not: two hundred times the shipped ones."""
_REMEDY = "; train it again with `garl train`, or restore the file"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Network:
    """Linear layers with ReLU between them, in double precision, so that CPUs agree.

    ``layers`` are (weight (out, in), bias (out,)); ``state`` is the name of the input's encoding.
    """

    state: str
    layers: tuple[tuple[Array, Array], ...]

    def values(self, state: NDArray[Any]) -> Array:
        """Return the value of each action, shape (actions,)."""
        signal: Array = state.astype(np.float64)
        for weight, bias in self.layers[:-1]:
            signal = np.maximum(weight @ signal + bias, 0.0)
        weight, bias = self.layers[-1]
        return np.asarray(weight @ signal + bias, dtype=np.float64)

    @property
    def text(self) -> str:
        """The sizes of its layers and all weights in single precision, for :func:`network_from`."""
        sizes = [len(self.layers[0][0][0]), *(len(bias) for _, bias in self.layers)]
        parts = [part.astype("<f4").tobytes() for layer in self.layers for part in layer]
        return f"{','.join(map(str, sizes))}:{base64.b64encode(b''.join(parts)).decode()}"


def network_from(text: str, state: str = WAITING) -> Network:
    """Return the network of a director from its text; raise PolicyError if it is none.

    ``state`` is the name of its input.
    """
    try:
        told, _, encoded = text.partition(":")
        sizes = [int(size) for size in told.split(",")]
        values = np.frombuffer(base64.b64decode(encoded, validate=True), "<f4").astype(np.float64)
        layers, rest = [], values
        for inputs, outputs in itertools.pairwise(sizes):
            weight, bias, rest = np.split(rest, [inputs * outputs, (inputs + 1) * outputs])
            layers.append((weight.reshape(outputs, inputs), bias))
    except ValueError as error:
        raise PolicyError(
            f"NPC policy: found the director {shown(text)}; expected the sizes of its layers and "
            f"its weights ({error})"
        ) from error
    _check(Path("the director of this search"), layers, state)
    return Network(state=state, layers=tuple(layers))


class LearnedPolicy:
    """Takes the action with the highest value; one instance moves one NPC.

    Raises PolicyError if the file is missing or damaged, or has another hash.
    """

    def __init__(self, weights: str, sha256: str) -> None:
        self._network = _load(weights, sha256)
        self._encoding = ENCODINGS[self._network.state]

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Do nothing: the state holds everything."""

    def decide(self, situation: Situation) -> Move:
        """Return the best action, or stay if it is another NPC's turn."""
        if self._encoding.one_npc_acts and not on_turn(situation):
            return STAY
        values = self._network.values(self._encoding.state(situation))
        return self._encoding.moves(situation)[int(np.argmax(values))]


def shipped(grade: str) -> str:
    """Return the path of the weights of a grade."""
    return str(WEIGHTS / "grades" / f"{grade}.npz")


class LearnedRule:
    """Decides for an NPC that perceives the UAV in part: the best action by weights in a file.

    Without a hash the one in the manifest holds.  Raises PolicyError if the file is missing or
    damaged, or has another hash.
    """

    def __init__(self, weights: str, sha256: str = "") -> None:
        known = sha256 or str(read_manifest(Path(weights))["sha256"])
        self._network = _load(weights, known)
        self._encoding = ENCODINGS[self._network.state]

    def decide(self, belief: Belief) -> Move:
        """Return the best action."""
        values = self._network.values(self._encoding.state(belief))
        return self._encoding.moves(belief)[int(np.argmax(values))]


class LearnedInterfering(Interfering):
    """An NPC of a grade, that decides by weights of ``garl train``."""

    def __init__(self, weights: str, sha256: str, grade: str) -> None:
        super().__init__(grade, LearnedRule(weights, sha256))


def learned_director(weights: Path = DIRECTOR, sha256: str = "") -> LearnedDirector:
    """Return a director with weights of a file; without a hash the one in the manifest holds.

    Raises PolicyError if the file is missing or damaged, or decides something else.
    """
    manifest = read_manifest(weights)
    if manifest["state"] != WAITING:
        raise _wrong(
            weights,
            f"has the state {shown(manifest['state'])}; expected {WAITING!r}, that of a director",
        )
    return LearnedDirector(network=_load(str(weights), sha256 or str(manifest["sha256"])))


def learned_spec(name: str) -> PolicySpec:
    """Return the specification of a shipped policy, or of one in a file.

    ``name`` is that of shipped weights, or the path of weights (``.npz``) that ``garl train``
    wrote, with their manifest (``.json``) beside them.  Raises PolicyError if the file is missing
    or damaged, or contradicts its manifest.
    """
    path = _path(name)
    manifest = read_manifest(path)
    if manifest["state"] == WAITING:
        raise PolicyError(
            f"NPC policy: {path} decides when NPCs begin, and moves none; expected weights with "
            f"one of the states {', '.join(ENCODINGS)}"
        )
    sha256 = str(manifest["sha256"])
    weights = name if path.parent == WEIGHTS else str(path.resolve())
    _load(weights, sha256)
    arguments = (("weights", weights), ("sha256", sha256))
    if ENCODINGS[str(manifest["state"])].is_belief:
        grade = _strongest_grade(path, manifest)
        return PolicySpec(
            name=name,
            factory=f"{__name__}:{LearnedInterfering.__name__}",
            arguments=(*arguments, ("grade", grade)),
        )
    return PolicySpec(
        name=name, factory=f"{__name__}:{LearnedPolicy.__name__}", arguments=arguments
    )


def _strongest_grade(path: Path, manifest: Mapping[str, Any]) -> str:
    surrogate = manifest.get("surrogate")
    named = surrogate.get("grades", ()) if isinstance(surrogate, dict) else ()
    grades = [grade for grade in GRADE_LIMITS if grade in named]
    if not grades:
        raise _wrong(path, f"names no grade in its manifest; known: {', '.join(GRADE_LIMITS)}")
    return grades[-1]


def save(path: Path, network: Network, about: Mapping[str, Any]) -> None:
    """Write weights to ``path`` (.npz, no pickles) and their manifest (.json) beside it."""
    arrays: dict[str, Any] = {}
    for index, (weight, bias) in enumerate(network.layers):
        arrays[f"weight_{index}"] = weight.astype(np.float32)
        arrays[f"bias_{index}"] = bias.astype(np.float32)
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(buffer.getvalue())
    manifest = {
        "format": FORMAT,
        "state": network.state,
        "sha256": hashlib.sha256(buffer.getvalue()).hexdigest(),
        **about,
    }
    path.with_suffix(".json").write_text(json.dumps(manifest, indent=2) + "\n", encoding="utf-8")


def read_manifest(path: Path) -> dict[str, Any]:
    """Return the manifest of weights at ``path``; raise PolicyError if it is not a manifest."""
    if not path.is_file():
        raise PolicyError(
            f"NPC policy: there are no weights at {path}; expected a file of `garl train`"
        )
    file = path.with_suffix(".json")
    try:
        manifest = parse_json(read_bytes(file, error=PolicyError))
    except (PolicyError, ValueError) as error:
        raise _wrong(file, f"is not a readable manifest ({error})") from error
    if not isinstance(manifest, dict):
        raise _wrong(
            file, f"is not a readable manifest (found {shown(manifest)}, expected a table)"
        )
    known = {"format", "state", "sha256"} <= manifest.keys()
    if not known or manifest["format"] != FORMAT:
        raise _wrong(file, f"is not a manifest of format {FORMAT}")
    if str(manifest["state"]) not in SHAPES:
        state = shown(manifest["state"])
        raise _wrong(file, f"names the state {state}; known: {', '.join(SHAPES)}")
    return manifest


@functools.lru_cache(maxsize=8)
def _load(weights: str, sha256: str) -> Network:
    path = _path(weights)
    manifest = read_manifest(path)
    data = read_bytes(path, _LARGEST, PolicyError, _REMEDY)
    found = hashlib.sha256(data).hexdigest()
    if not found == sha256 == manifest["sha256"]:
        raise _wrong(path, f"has the hash {found[:16]}…, its manifest says {sha256[:16]}…")
    try:
        arrays = unpack(data, _LARGEST)
    except ValueError as error:
        raise _wrong(path, f"is not a file of weights ({error})") from error
    count = len(arrays) // 2
    expected = {f"{part}_{index}" for index in range(count) for part in ("weight", "bias")}
    if arrays.keys() != expected:
        found = listed(sorted(arrays))
        raise _wrong(
            path, f"is not a file of weights (found {found}; expected weight_0, bias_0, …)"
        )
    layers = [
        (arrays[f"weight_{index}"].astype(np.float64), arrays[f"bias_{index}"].astype(np.float64))
        for index in range(count)
    ]
    _check(path, layers, manifest["state"])
    return Network(state=manifest["state"], layers=tuple(layers))


def _check(path: Path, layers: Sequence[tuple[Array, Array]], state: str) -> None:
    size, actions = SHAPES[state]
    for weight, bias in layers:
        if weight.ndim != 2 or bias.shape != weight.shape[:1] or weight.shape[1] != size:
            raise _wrong(path, f"has a layer of shape {weight.shape} but {size} inputs")
        if not (np.isfinite(weight).all() and np.isfinite(bias).all()):
            raise _wrong(path, "has weights that are not finite")
        size = weight.shape[0]
    if size != actions:
        raise _wrong(path, f"has {size} actions; expected {actions} with the state {state!r}")


def _path(name: str) -> Path:
    return WEIGHTS / f"{name}.npz" if "/" not in name and "." not in name else Path(name)


def _wrong(path: Path, problem: str) -> PolicyError:
    return PolicyError(f"NPC policy: {path} {problem}{_REMEDY}")
