from __future__ import annotations

import io
import json
import os
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pytest_garl.errors import PolicyError
from pytest_garl.npcs.learned import Network, learned_spec, read_manifest, save
from pytest_garl.npcs.weights import WEIGHTS


def network(outputs: int = 5, state: str = "paper") -> Network:
    rng = np.random.default_rng(3)
    shapes = [(24, 4), (24, 24), (outputs, 24)]
    layers = tuple((rng.normal(size=shape), rng.normal(size=shape[0])) for shape in shapes)
    return Network(state=state, layers=layers)


def test_numpy_computes_what_torch_computes() -> None:
    torch = pytest.importorskip("torch")
    net = network()
    layers = []
    for index, (weight, bias) in enumerate(net.layers):
        linear = torch.nn.Linear(*reversed(weight.shape), dtype=torch.float64)
        with torch.no_grad():
            linear.weight.copy_(torch.from_numpy(weight))
            linear.bias.copy_(torch.from_numpy(bias))
        layers += [linear] + ([torch.nn.ReLU()] if index < 2 else [])
    reference = torch.nn.Sequential(*layers)
    states = np.random.default_rng(4).normal(size=(500, 4))
    theirs = reference(torch.from_numpy(states)).detach().numpy()
    ours = np.array([net.values(state) for state in states])
    assert ours == pytest.approx(theirs, abs=1e-12)
    assert (ours.argmax(axis=1) == theirs.argmax(axis=1)).all()


def test_saved_weights_are_loaded_unchanged_and_their_bytes_repeat(tmp_path: Path) -> None:
    net = network()
    save(tmp_path / "a.npz", net, {"seed": 1})
    save(tmp_path / "b.npz", net, {"seed": 1})
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    spec = learned_spec(str(tmp_path / "a.npz"))
    policy = spec.make()
    state = np.array([0.1, -0.4, 0.2, 0.9])
    loaded = policy._network.values(state)  # type: ignore[attr-defined]
    assert loaded == pytest.approx(net.values(state), abs=1e-4)
    assert read_manifest(tmp_path / "a.npz")["seed"] == 1


def _truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])


def _foreign(path: Path) -> None:
    path.write_bytes(b"no weights at all")
    _restamp(path)


def _restamp(path: Path) -> None:
    import hashlib

    file = path.with_suffix(".json")
    manifest = json.loads(file.read_text())
    file.write_text(
        json.dumps({**manifest, "sha256": hashlib.sha256(path.read_bytes()).hexdigest()})
    )


def _bomb(path: Path) -> None:
    """Write some kilobytes that hold two megabytes of zeros."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("weight_0", "bias_0"):
            with archive.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array_header_1_0(
                    member, {"descr": "<f8", "fortran_order": False, "shape": (125_000,)}
                )
                member.write(bytes(1_000_000))
    _restamp(path)


def _claim(path: Path) -> None:
    """Say in an array's header that it is as large as a terabyte."""
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        buffer, {"descr": "<f8", "fortran_order": False, "shape": (10**11, 4)}
    )
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("weight_0.npy", buffer.getvalue())
    _restamp(path)


def _extra(path: Path) -> None:
    arrays: dict[str, Any] = {"weight_0": np.zeros((5, 4)), "bias_1": np.zeros(5)}
    np.savez(path, **arrays)
    _restamp(path)


def _large(path: Path) -> None:
    path.write_bytes(bytes(1_000_001))
    _restamp(path)


def _pipe(path: Path) -> None:
    path.with_suffix(".json").unlink()
    os.mkfifo(path.with_suffix(".json"))


def _escape(path: Path) -> None:
    file = path.with_suffix(".json")
    file.write_text(json.dumps({**json.loads(file.read_text()), "sha256": "\x1b[2J"}))


def _list(path: Path) -> None:
    path.with_suffix(".json").write_text("[]")


def _array(path: Path) -> None:
    with path.open("wb") as file:
        np.save(file, np.zeros(3))
    _restamp(path)


def _other_state(path: Path) -> None:
    file = path.with_suffix(".json")
    file.write_text(json.dumps({**json.loads(file.read_text()), "state": "extended"}))


def _unknown_state(path: Path) -> None:
    file = path.with_suffix(".json")
    file.write_text(json.dumps({**json.loads(file.read_text()), "state": "psychic"}))


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (Path.unlink, "there are no weights at"),
        (_truncate, "has the hash"),
        (_foreign, "is not a file of weights"),
        (lambda path: path.with_suffix(".json").unlink(), "not a readable manifest"),
        (_array, "is not a file of weights"),
        (_list, "not a readable manifest"),
        (_bomb, "found 2000256 bytes when unpacked, expected at most 1000000"),
        (_claim, r"found 0 bytes for the shape \(100000000000, 4\)"),
        (_extra, "found bias_1, weight_0; expected weight_0, bias_0"),
        (_large, "found 1000001 bytes, expected at most 1000000"),
        (_pipe, "found a pipe, expected a regular file"),
        (_escape, r"its manifest says \\x1b\[2J"),
        (lambda path: path.with_suffix(".json").write_text("[" * 99_999), "nested too deeply"),
        (lambda path: path.with_suffix(".json").write_text("9" * 5000), "Exceeds the limit"),
        (lambda path: path.with_suffix(".json").write_text("{}"), "not a manifest of format 1"),
        (_other_state, "but 9 inputs"),
        (_unknown_state, "names the state 'psychic'; known: paper"),
    ],
)
def test_damaged_weights_are_refused(
    tmp_path: Path, damage: Callable[[Path], object], words: str
) -> None:
    path = tmp_path / "w.npz"
    save(path, network(), {})
    damage(path)
    with pytest.raises(PolicyError, match=words):
        learned_spec(str(path))


def test_a_network_with_other_actions_is_refused(tmp_path: Path) -> None:
    save(tmp_path / "w.npz", network(outputs=6), {})
    with pytest.raises(PolicyError, match="has 6 actions; expected 5 with the state 'paper'"):
        learned_spec(str(tmp_path / "w.npz"))


def test_infinite_weights_are_refused(tmp_path: Path) -> None:
    net = network()
    net.layers[0][0][0, 0] = np.nan
    save(tmp_path / "w.npz", net, {})
    with pytest.raises(PolicyError, match="not finite"):
        learned_spec(str(tmp_path / "w.npz"))


def test_the_online_rivals_weights_say_that_they_control_the_environment() -> None:
    manifest = read_manifest(WEIGHTS / "online-rl.npz")
    assert (manifest["state"], manifest["surrogate"]["environment"]) == ("online", "drawn")
    assert manifest["training"]["episodes"] == 800
    assert manifest["surrogate"]["reward"] == "paper"


@pytest.mark.parametrize("name", ["dqn", "dqn-paper"])
def test_shipped_weights_are_small_and_say_where_they_come_from(name: str) -> None:
    assert (WEIGHTS / f"{name}.npz").stat().st_size < 50_000
    manifest = read_manifest(WEIGHTS / f"{name}.npz")
    assert manifest["training"]["episodes"] == 800
    assert len(manifest["validation"]) == 5
    rates = {int(seed): score["collided"] for seed, score in manifest["validation"].items()}
    assert rates[manifest["seed"]] == max(rates.values())
    assert {"numpy", "torch", "pytest-garl"} <= manifest["versions"].keys()
