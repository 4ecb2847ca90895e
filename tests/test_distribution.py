"""What a user installs: the wheel works without the checkout, and only the sdist holds the lab."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

from pytest_garl.cli import COMMANDS

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
REFUSED = "pybullet-arm64==3.2.8+no.wheel.for.this.machine"
FORK = "pybullet-arm64<4,>=3.2.8"
PYBULLET = "pybullet>=3.2.7"


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


@pytest.mark.parametrize(
    ("system", "machine", "python", "engine"),
    [
        ("linux", "x86_64", "3.11", PYBULLET),
        ("linux", "x86_64", "3.12", FORK),
        ("linux", "x86_64", "3.13", FORK),
        ("linux", "aarch64", "3.11", REFUSED),
        ("linux", "aarch64", "3.13", REFUSED),
        ("darwin", "arm64", "3.11", FORK),
        ("darwin", "arm64", "3.13", FORK),
        ("darwin", "x86_64", "3.12", FORK),
        ("darwin", "x86_64", "3.13", REFUSED),
        ("win32", "AMD64", "3.11", FORK),
        ("win32", "ARM64", "3.13", REFUSED),
        ("freebsd14", "amd64", "3.12", REFUSED),
    ],
)
def test_each_machine_gets_the_engine_that_has_a_wheel_for_it(
    system: str, machine: str, python: str, engine: str
) -> None:
    """Of the wheels of pybullet 3.2.7 and pybullet-arm64 3.2.8."""
    environment = {"sys_platform": system, "platform_machine": machine, "python_version": python}
    engines = [
        f"{wanted.name}{wanted.specifier}"
        for wanted in map(Requirement, PROJECT["dependencies"])
        if wanted.name.startswith("pybullet")
        and (wanted.marker is None or wanted.marker.evaluate(environment))
    ]
    assert engines == [engine]


def test_pip_refuses_a_python_for_which_the_engine_has_no_wheel() -> None:
    allowed = SpecifierSet(PROJECT["requires-python"])
    tried = ("3.10.13", "3.11.7", "3.12.1", "3.13.0", "3.14.0")
    assert [each for each in tried if each in allowed] == ["3.11.7", "3.12.1", "3.13.0"]
    named = {each.rpartition(" ")[2] for each in PROJECT["classifiers"] if ":: 3." in each}
    assert named == {"3.11", "3.12", "3.13"}
