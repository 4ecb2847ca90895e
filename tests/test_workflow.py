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


ACTION: dict[str, Any] = YAML(typ="safe").load(ROOT / "action.yml")
STEPS = ACTION["runs"]["steps"]


def inputs(job: str) -> dict[str, str]:
    """Return what a job gives to the action, and the defaults of the rest."""
    (step,) = (step for step in JOBS[job]["steps"] if "with" in step)
    assert step["uses"] == "OWNER/pytest-garl@COMMIT"
    assert set(step["with"]) <= set(ACTION["inputs"])
    return {**{name: each["default"] for name, each in ACTION["inputs"].items()}, **step["with"]}


def command(name: str, job: str) -> tuple[str, dict[str, str]]:
    """Return what a step of the action runs for a job, and its environment."""
    (step,) = (step for step in STEPS if step.get("name") == name)
    given = inputs(job)
    environment = {
        key: re.sub(r"\$\{\{ inputs\.(\S+) \}\}", lambda found: given[found[1]], value)
        for key, value in step.get("env", {}).items()
    }
    return step["run"], environment


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


def sh(name: str, job: str, folder: Path, **changed: str) -> subprocess.CompletedProcess[str]:
    """Run a step of the action for a job, as GitHub does."""
    run, given = command(name, job)
    environment = {
        **os.environ,
        "CI": "true",
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(SUPPORT),
        **given,
        **changed,
    }
    return subprocess.run(
        ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", run],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


def test_gate_of_a_pull_request_is_green_in_a_project_without_cases(project: Path) -> None:
    for name in ("Check the saved cases", "Fly"):
        done = sh(name, "gate", project)
        assert done.returncode == 0, done.stdout + done.stderr
    assert (project / "report.xml").is_file()


def test_search_of_the_night_leaves_what_is_uploaded(project: Path) -> None:
    wanted = inputs("search")["arguments"]
    # So few flights take seconds.
    few = wanted.replace("=400", "=8").replace("=random", "=0")
    assert few != wanted
    done = sh("Fly", "search", project, ARGUMENTS=few)
    assert done.returncode == 1, done.stdout + done.stderr
    uploaded = STEPS[-1]["with"]["path"].split()
    assert [path for path in uploaded if not (project / path).exists()] == []


def test_archive_of_a_night_is_restored_used_and_saved_though_the_night_fails(
    project: Path,
) -> None:
    restored, saved = (step for step in STEPS if "cache/" in step.get("uses", ""))
    assert restored["with"]["path"] == saved["with"]["path"] == "${{ inputs.archive }}"
    key = restored["with"]["key"]
    assert key == saved["with"]["key"]
    assert key.startswith(restored["with"]["restore-keys"])
    # A cache never changes: each run needs a key of its own.
    assert "github.run_id" in key
    assert (restored["if"], saved["if"]) == (
        "inputs.archive != ''",
        "always() && inputs.archive != ''",
    )
    for seed in "01":
        few = f"--garl-budget=8 --garl-shrink=0 --garl-seed={seed}"
        done = sh("Fly", "search", project, ARGUMENTS=few, ARCHIVE="night.archive")
        assert done.returncode in (0, 1), done.stdout + done.stderr
        assert (project / "night.archive").is_file()
    assert re.search("^archive: .*, 16 flights known", done.stdout, re.M)


def test_arguments_of_the_action_are_words_of_a_shell(project: Path) -> None:
    done = sh("Fly", "gate", project, ARGUMENTS="-k 'time and nothing' --co -q")
    assert "test_lands_in_time" in done.stdout
    assert "test_collides" not in done.stdout


def test_jobs_upload_under_names_of_their_own() -> None:
    assert len({inputs(job)["artefact"] for job in JOBS}) == len(JOBS)


@pytest.mark.parametrize(("job", "extras"), [("gate", set()), ("search", {"video"})])
def test_action_installs_itself_with_its_versions(
    job: str, extras: set[str], tmp_path: Path
) -> None:
    (tmp_path / "pip").write_text('#!/bin/sh\nprintf "%s\\n" "$@"\n')
    (tmp_path / "pip").chmod(0o755)
    path = f"{tmp_path}{os.pathsep}{os.environ['PATH']}"
    done = sh(
        "Install", job, tmp_path, PATH=path, GITHUB_ACTION_PATH=str(ROOT), INSTALL="echo 'mine too'"
    )
    first, *_, versions, requirement, mine = done.stdout.splitlines()
    assert (first, versions, mine) == ("install", str(ROOT / "constraints.txt"), "mine too")
    wanted = Requirement(requirement)
    assert (wanted.name, wanted.extras, wanted.url) == ("pytest-garl", extras, f"file://{ROOT}")


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


def test_action_takes_a_python_that_is_supported() -> None:
    allowed = SpecifierSet(
        tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["requires-python"]
    )
    python = ACTION["inputs"]["python-version"]
    assert python["default"] in allowed
    assert [each for each in re.findall(r"3\.\d+", python["description"]) if each in allowed]


def settings_of_the_page() -> str:
    (block,) = re.findall(r"```toml\n(.*?)```", (ROOT / "docs" / "ci.md").read_text(), re.S)
    return str(block)


def test_settings_of_the_page_are_all_there_are(project: Path) -> None:
    named = re.findall(r"^(?:# )?(garl_[\w-]+) = ", settings_of_the_page(), re.M)
    shown = subprocess.run(
        [sys.executable, "-m", "pytest", "--help"], capture_output=True, text=True, check=True
    ).stdout
    assert sorted(named) == sorted(re.findall(r"^  (garl_[\w-]+) \(", shown, re.M))


def runs_of_the_page() -> list[str]:
    """Return the commands of the table of runs: at the desk, for a pull request, in the night."""
    rows = (ROOT / "docs" / "ci.md").read_text().partition("| where | command |")[2]
    return re.findall(r"^\| (?:at the desk|pull request|night) \| `([^`]+)`", rows, re.M)


@pytest.mark.parametrize(("run", "slots"), [*zip(runs_of_the_page(), (16, 0, 800), strict=True)])
def test_runs_of_the_page_collect_what_they_say_with_its_settings(
    run: str, slots: int, project: Path
) -> None:
    (project / "pytest.ini").unlink()
    (project / "pyproject.toml").write_text(settings_of_the_page())
    given = {key: value for key, value in os.environ.items() if key != "PYTEST_ADDOPTS"}
    path = os.pathsep.join([str(SUPPORT), str(project)])
    done = subprocess.run(
        [sys.executable, "-m", *shlex.split(run), "--collect-only", "-q"],
        cwd=project,
        env={**given, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert len(set(re.findall(r"\[((?:lawn|court)-g\d+-s\d+)\]", done.stdout))) == slots


def test_settings_of_the_page_are_the_defaults(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    # It says that the tests of this project fly no probes.
    monkeypatch.delenv("PYTEST_ADDOPTS")
    config = pytester.parseconfig()
    defaults = tomllib.loads(settings_of_the_page())["tool"]["pytest"]["ini_options"]
    assert {name: config.getini(name) or value for name, value in defaults.items()} == defaults
