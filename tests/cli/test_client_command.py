"""``garl client`` writes the files by which a program flies, and replaces older ones."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from pytest_garl.cli import main
from tests.external.programs import CLIENTS


def test_the_file_of_each_language_is_written_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    wrote = CliRunner().invoke(main, ["client", "python", "cpp"])
    assert wrote.output.split() == ["wrote", "garl_client.py", "wrote", "garl.hpp"]
    (tmp_path / "garl.hpp").write_text("// an older one")
    again = CliRunner().invoke(main, ["client", "cpp", "ros2"])
    assert again.output.splitlines() == [
        "updated    garl.hpp",
        "kept       garl_client.py",
        "wrote      garl_ros2.py",
    ]
    for name in ("garl_client.py", "garl.hpp", "garl_ros2.py"):
        assert (tmp_path / name).read_bytes() == (CLIENTS / name).read_bytes()


def test_another_language_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    refused = CliRunner().invoke(main, ["client", "rust"])
    assert refused.exit_code == 2
    assert "there is no 'rust'; expected python, cpp, ros2" in refused.output
    assert not list(tmp_path.iterdir())
