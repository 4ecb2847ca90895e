"""What a user installs: the wheel works without the checkout, and only the sdist holds the lab."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from email import message_from_bytes
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from ruamel.yaml import YAML

from pytest_garl import __version__
from pytest_garl.cli import COMMANDS

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
REFUSED = "pybullet-arm64==3.2.8+no.wheel.for.this.machine"
FORK = "pybullet-arm64<4,>=3.2.8"
PYBULLET = "pybullet>=3.2.7"
MUJOCO = "mujoco-core<5,>=4.0.1"


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
        names = archive.namelist()
    assert {top for top in tops if not top.endswith(".dist-info")} == {"pytest_garl"}
    assert "pytest_garl/example/landing_systems/opencv_mls.py" in names
    assert not [name for name in names if "__pycache__" in name]
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
        ("linux", "x86_64", "3.14", MUJOCO),
        ("linux", "aarch64", "3.11", MUJOCO),
        ("linux", "aarch64", "3.14", MUJOCO),
        ("linux", "riscv64", "3.13", REFUSED),
        ("darwin", "arm64", "3.11", FORK),
        ("darwin", "arm64", "3.13", FORK),
        ("darwin", "arm64", "3.14", MUJOCO),
        ("darwin", "x86_64", "3.12", FORK),
        ("darwin", "x86_64", "3.13", REFUSED),
        ("darwin", "x86_64", "3.14", REFUSED),
        ("win32", "AMD64", "3.11", FORK),
        ("win32", "AMD64", "3.14", MUJOCO),
        ("win32", "ARM64", "3.13", REFUSED),
        ("freebsd14", "amd64", "3.12", REFUSED),
    ],
)
def test_each_machine_gets_the_engine_that_has_a_wheel_for_it(
    system: str, machine: str, python: str, engine: str
) -> None:
    """Of the wheels of pybullet 3.2.7, pybullet-arm64 3.2.8 and mujoco-core 4.0.1."""
    environment = {"sys_platform": system, "platform_machine": machine, "python_version": python}
    engines = [
        f"{wanted.name}{wanted.specifier}"
        for wanted in map(Requirement, PROJECT["dependencies"])
        if wanted.name.startswith(("mujoco", "pybullet"))
        and (wanted.marker is None or wanted.marker.evaluate(environment))
    ]
    assert engines == [engine]


def test_pip_refuses_a_python_for_which_the_engine_has_no_wheel() -> None:
    allowed = SpecifierSet(PROJECT["requires-python"])
    tried = ("3.10.13", "3.11.7", "3.12.1", "3.13.0", "3.14.0", "3.15.0")
    assert [each for each in tried if each in allowed] == [*tried[1:5]]
    named = {each.rpartition(" ")[2] for each in PROJECT["classifiers"] if ":: 3." in each}
    assert named == {"3.11", "3.12", "3.13", "3.14"}


def test_readme_of_the_wheel_links_to_files_of_the_repository(built: Path) -> None:
    (wheel,) = built.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (each for each in archive.namelist() if each.endswith("/METADATA"))
        metadata = message_from_bytes(archive.read(name))
    text = metadata.get_payload(decode=True)
    assert isinstance(text, bytes)
    links = set(re.findall(r"\]\(([^)]+)\)", text.decode()))
    address = PROJECT["urls"]["Repository"]
    assert f"{address}/blob/v{__version__}/docs/index.md" in links
    picture = f"{address}/v{__version__}/docs/pictures/flight.gif"
    assert picture.replace("github.com", "raw.githubusercontent.com") in links
    assert [link for link in links if not link.startswith(("https://", "#"))] == []
    named = {each.partition(f"/v{__version__}/")[2].partition("#")[0] for each in links}
    assert [name for name in named if not (ROOT / name).exists()] == []
    assert sorted(metadata.get_all("Project-URL", [])) == sorted(
        f"{name}, {url}" for name, url in PROJECT["urls"].items()
    )


def guards() -> list[str]:
    """Return the commands of the release that look at its files before anything is built."""
    steps = YAML(typ="safe").load(ROOT / ".github" / "workflows" / "release.yml")["jobs"]["build"]
    return [step["run"] for step in steps["steps"] if "name" in step]


@pytest.mark.parametrize(
    ("owner", "tag", "passing"),
    [
        ("OWNER", f"v{__version__}", [False, True]),
        ("somebody", f"v{__version__}", [True, True]),
        ("somebody", "v0.0.1", [True, False]),
    ],
)
def test_release_needs_an_address_and_the_tag_of_the_version(
    owner: str, tag: str, passing: list[bool], tmp_path: Path
) -> None:
    (tmp_path / "pytest_garl").mkdir()
    shutil.copy(ROOT / "pytest_garl" / "__init__.py", tmp_path / "pytest_garl")
    text = (ROOT / "pyproject.toml").read_text()
    (tmp_path / "pyproject.toml").write_text(text.replace("OWNER", owner))
    done = [
        subprocess.run(
            ["bash", "-ec", command],
            cwd=tmp_path,
            env={**os.environ, "GITHUB_REF_NAME": tag},
            capture_output=True,
            check=False,
        )
        for command in guards()
    ]
    assert [each.returncode == 0 for each in done] == passing


@pytest.mark.long
def test_what_is_uploaded_passes_the_check_of_twine(built: Path) -> None:
    pytest.importorskip("twine")
    command = [sys.executable, "-m", "twine", "check", "--strict", *map(str, built.iterdir())]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


@pytest.mark.long
@pytest.mark.sim
def test_wheel_works_in_an_empty_environment(
    built: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The commands of the README, as a user runs them: the folder of the wheel is the index."""
    for name in ("PYTEST_ADDOPTS", "PYTHONPATH"):
        monkeypatch.delenv(name, raising=False)
    venv.create(tmp_path / "env", with_pip=True)
    monkeypatch.setenv("PATH", f"{tmp_path / 'env' / 'bin'}{os.pathsep}{os.environ['PATH']}")
    project, example = tmp_path / "project", tmp_path / "example"

    def run(command: str, folder: Path, status: int = 0) -> str:
        folder.mkdir(exist_ok=True)
        done = subprocess.run(
            ["bash", "-ec", command], cwd=folder, capture_output=True, text=True, check=False
        )
        assert done.returncode == status, f"{command}: {done.stdout}{done.stderr}"
        return done.stdout

    wanted = f"-c {ROOT / 'constraints.txt'} --find-links {built} pytest-garl=={__version__}"
    run(f"pip install --quiet {wanted}", project)
    run("pip check", project)
    run("garl init", project)
    assert "landed" in run("garl check test_my_landing.py", project)
    run("pytest --garl-budget=16 --garl-map=lawn test_my_landing.py", project, 1)
    assert [*project.glob("scenarios/regressions/my_landing/*.toml")]
    run("garl init --example", example)
    assert "landed" in run("garl check landing_systems/test_opencv_mls.py", example)
