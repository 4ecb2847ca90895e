"""What a user installs: the wheel works without the checkout, and only the sdist holds the lab."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from pytest_garl.cli import COMMANDS

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the wheel and the sdist."""
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "hatchling", "build", "-d", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def test_only_the_sdist_holds_the_lab(built: Path) -> None:
    (wheel,), (sdist,) = built.glob("*.whl"), built.glob("*.tar.gz")
    with zipfile.ZipFile(wheel) as archive:
        tops = {name.partition("/")[0] for name in archive.namelist()}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"pytest_garl"}
    with tarfile.open(sdist) as tar:
        assert any("/lab/faults/" in name for name in tar.getnames())


def test_every_command_of_the_wheel_explains_itself(built: Path, tmp_path: Path) -> None:
    (wheel,) = built.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "site")
    code = (
        "import pytest_garl.cli, sys\n"
        "from click.testing import CliRunner\n"
        "assert pytest_garl.__file__.startswith(sys.argv[1])\n"
        "for name in sys.argv[2:]:\n"
        "    result = CliRunner().invoke(pytest_garl.cli.main, [name, '--help'])\n"
        "    assert result.exit_code == 0 and 'Usage' in result.output, (name, result.output)\n"
    )
    site = tmp_path / "site"
    command = [sys.executable, "-c", code, str(site), *COMMANDS]
    environment = {**os.environ, "PYTHONPATH": str(site)}
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
