"""The workflow to copy: its steps run in a project that has nothing but a landing system."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from ruamel.yaml import YAML

from pytest_garl.cli import main
from tests.plugin.test_resume import SLOW
from tests.support.landing_project import CONFTEST

ROOT = Path(__file__).parents[1]
WORKFLOW: dict[str, Any] = YAML(typ="safe").load(ROOT / "docs" / "github-actions.yml")
JOBS = WORKFLOW["jobs"]
SUPPORT = Path(__file__).with_name("support")


def commands(job: str) -> list[str]:
    return [step["run"].strip() for step in JOBS[job]["steps"] if "run" in step]


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a project as `garl init` leaves it, with the fast simulator of the tests."""
    (tmp_path / "lander.py").write_text(SLOW)
    (tmp_path / "conftest.py").write_text(CONFTEST)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.delitem(sys.modules, "lander", raising=False)
    done = CliRunner().invoke(main, ["init", "lander:Slow"])
    assert done.exit_code == 0, done.output
    text = (tmp_path / "pytest.ini").read_text()
    (tmp_path / "pytest.ini").write_text(text.replace("= field", "= paper"))
    return tmp_path


def sh(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = {
        **os.environ,
        "CI": "true",
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(SUPPORT),
    }
    return subprocess.run(
        ["bash", "-ec", command],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


def test_gate_of_a_pull_request_is_green_in_a_project_without_cases(project: Path) -> None:
    _, *steps = commands("gate")
    assert [step.split()[0] for step in steps] == ["garl", "pytest"]
    for step in steps:
        done = sh(step, project)
        assert done.returncode == 0, done.stdout + done.stderr
    assert (project / "report.xml").is_file()


def test_search_of_the_night_leaves_what_is_uploaded(project: Path) -> None:
    _, step = commands("search")
    # So few flights take seconds.
    done = sh(step.replace("=400", "=8").replace("=random", "=0"), project)
    assert done.returncode == 1, done.stdout + done.stderr
    uploaded = JOBS["search"]["steps"][-1]["with"]["path"].split()
    assert [path for path in uploaded if not (project / path).exists()] == []


@pytest.mark.parametrize(("job", "extras"), [("gate", set()), ("search", {"video"})])
def test_install_line_is_one_that_pip_understands(job: str, extras: set[str]) -> None:
    found = shlex.split(commands(job)[0].replace("$PYTEST_GARL", WORKFLOW["env"]["PYTEST_GARL"]))
    assert found[:4] == ["pip", "install", "-c", "constraints.txt"]
    wanted = Requirement(found[4])
    assert (wanted.name, wanted.extras) == ("pytest-garl", extras)
    assert wanted.url == "git+https://HOST/PATH.git@COMMIT"
    assert (ROOT / "constraints.txt").is_file()


def test_every_install_line_of_the_pages_names_extras_that_exist() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    lines = [
        line
        for page in [ROOT / "README.md", *ROOT.glob("docs/**/*.md"), *ROOT.glob("docs/*.yml")]
        for line in re.findall(r"pip install[^\n`#]*", page.read_text())
    ]
    extras = {name for line in lines for name in re.findall(r"\[(\w+)\]", line)}
    assert extras
    assert extras <= {*project["optional-dependencies"]}
    # It is on no index: a line names a checkout, a repository, or an extra of what is installed.
    assert [line for line in lines if re.search(r"pytest-garl(?!\[|.* @ )", line)] == []


def test_workflow_takes_a_python_that_is_supported() -> None:
    allowed = SpecifierSet(
        tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["requires-python"]
    )
    setups = [step for job in JOBS.values() for step in job["steps"] if "setup-python" in str(step)]
    assert setups
    for setup in setups:
        assert setup["with"]["python-version"] in allowed
