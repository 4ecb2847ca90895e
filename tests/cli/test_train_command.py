from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

pytest.importorskip("torch")
from pytest_garl.cli import main
from pytest_garl.npcs.learned import learned_spec


@pytest.mark.sim
def test_garl_train_writes_weights_that_can_be_flown(tmp_path: Path) -> None:
    out = tmp_path / "dogs.npz"
    arguments = ["train", "--map=court", "--type=dog", "--episodes=2", "--seeds=2"]
    arguments += [
        "--state=extended",
        "--uav=both",
        "--validation=2",
        f"--folder={tmp_path / 'folder'}",
        f"--out={out}",
    ]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    assert "kept seed" in result.output
    assert learned_spec(str(out)).make()
    manifest = json.loads(out.with_suffix(".json").read_text())
    assert manifest["surrogate"]["types"] == ["dog"]
    assert (manifest["state"], manifest["surrogate"]["uav"]) == ("extended", "both")
    assert manifest["validation"].keys() == {"0", "1"}
    assert manifest["other_episodes"]["episodes"] == 2
    assert len(manifest["sources"]) == 64
    assert out.with_suffix(".png").stat().st_size > 1000


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--type=cat"], "--type: found 'cat', expected some of person, child, dog, bird"),
        (["--map=moon"], "unknown map 'moon'"),
        (["--type=,"], "found ',', expected names"),
        (["--out=policy.pt"], "expected a name that ends in .npz"),
        (["--system=nowhere:System"], "--system: found 'nowhere:System', which cannot be loaded"),
    ],
)
def test_bad_arguments_are_one_clear_error(arguments: list[str], words: str) -> None:
    result = CliRunner().invoke(main, ["train", *arguments])
    assert result.exit_code == 1
    assert words in result.output
    assert "Traceback" not in result.output
