"""Foreign landing systems: their clones are prepared, and flown if their code is there."""

from __future__ import annotations

import importlib
import io
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.foreign.__main__ import flown, row
from lab.foreign.catalogue import SYSTEMS, Foreign, calibration
from lab.foreign.repository import FOLDER, ForeignCodeError, Repository
from pytest_garl import Camera
from pytest_garl.scenarios.files import load
from tests.companion.processes import running

TEXT = "gain = 1\n"


def git(folder: Path, *arguments: str) -> str:
    who = ["-c", "user.name=a", "-c", "user.email=a@b"]
    done = subprocess.run(
        ["git", *who, *arguments], cwd=folder, check=True, capture_output=True, text=True
    )
    return done.stdout.strip()


@pytest.fixture
def repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Repository:
    """Return a repository whose clone has a second commit, which is not the one that flies."""
    monkeypatch.setenv(FOLDER, str(tmp_path))
    clone = tmp_path / "who+what"
    (clone / "src").mkdir(parents=True)
    (clone / "src/a.py").write_text(TEXT)
    (clone / "notes").write_text("long")
    git(clone, "init", "--quiet")
    git(clone, "add", ".")
    git(clone, "commit", "--quiet", "-m", "first")
    commit = git(clone, "rev-parse", "HEAD")
    (clone / "src/a.py").write_text("gain = 2\n")
    git(clone, "commit", "--quiet", "-am", "second")
    return Repository(name="who/what", commit=commit, licence="MIT", paths=("src",))


def test_missing_clone_says_what_to_clone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FOLDER, str(tmp_path))
    none = Repository(name="who/what", commit="c0ffee", licence="MIT", paths=())
    assert "Clone https://github.com/who/what" in none.problem
    assert "c0ffee" in none.problem
    (tmp_path / "who+what").mkdir()
    assert "does not have the commit" in none.problem


def test_unset_folder_is_a_problem(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(FOLDER, raising=False)
    assert FOLDER in Repository(name="who/what", commit="c0ffee", licence="MIT", paths=()).problem


def test_files_of_the_commit_are_prepared_with_the_changes(repository: Repository) -> None:
    folder = repository.prepared({"src/a.py": {"1": "3"}, "src/b.txt": "new"})
    assert (folder / "src/a.py").read_text() == "gain = 3\n"
    assert (folder / "src/b.txt").read_text() == "new"
    assert not (folder / "notes").exists()
    assert repository.prepared({"src/a.py": {"1": "3"}, "src/b.txt": "new"}) == folder
    assert (repository.prepared({}) / "src/a.py").read_text() == TEXT


@pytest.mark.parametrize("old", ["n", "nowhere"])
def test_text_to_change_must_be_there_once(repository: Repository, old: str) -> None:
    with pytest.raises(ForeignCodeError, match="expected once"):
        repository.prepared({"src/a.py": {"gain = 1": "gain = nn", old: "x"}})


def test_calibration_files_hold_the_camera() -> None:
    camera = Camera(distortion=(0.1, 0.0, 0.0, 0.0))
    files = calibration(camera, "raspi")
    matrix, distortion = (
        np.loadtxt(io.StringIO(files[f"camera{each}_raspi.txt"]), delimiter=",")
        for each in ("Matrix", "Distortion")
    )
    assert matrix == pytest.approx(camera.matrix)
    assert distortion.tolist() == [0.1, 0.0, 0.0, 0.0]


def test_message_that_is_posted_reaches_the_vehicle(tmp_path: Path) -> None:
    text = f"""
        import json, sys, urllib.error, urllib.request
        sys.path.insert(0, {str(Path("lab/foreign").resolve())!r})
        import mavlink2rest
        mavlink2rest.serve()
        url = f"http://host.docker.internal:{{mavlink2rest.PORT}}/mavlink"
        message = dict(type="LANDING_TARGET", time_usec=5, target_num=7, angle_x=0.25, angle_y=0.0,
                       frame=dict(type="MAV_FRAME_LOCAL_FRD"), distance=0.0, size_x=0.0, size_y=0.0,
                       x=1.0, y=0.0, z=0.0, q=[1.0, 0.0, 0.0, 0.0],
                       position_type=dict(type="LANDING_TARGET_TYPE_VISION_FIDUCIAL"))
        data = json.dumps(dict(message=message)).encode()
        print(urllib.request.urlopen(urllib.request.Request(url, data), timeout=5).status)
        try:
            urllib.request.urlopen(url)
        except urllib.error.HTTPError as error:
            print(error.code)
    """
    with running(tmp_path, text, python=sys.executable) as simulator:
        simulator.fly(1.0)
        assert simulator.printed.split() == ["200", "404"]
        found: Any = _parsed(simulator.sent)
        assert (found.get_type(), found.angle_x, found.x, found.type) == (
            *("LANDING_TARGET", 0.25, 1.0),
            *(2,),
        )


def _parsed(data: bytes) -> Any:
    common: Any = importlib.import_module("pymavlink.dialects.v20.common")
    return common.MAVLink(None).parse_buffer(data)[0]


def _fly_or_skip(foreign: Foreign) -> Foreign:
    if foreign.problem:
        pytest.skip(foreign.problem)
    return foreign


@pytest.mark.sim
@pytest.mark.parametrize("foreign", SYSTEMS, ids=lambda foreign: foreign.name)
def test_foreign_system_lands_on_its_marker(foreign: Foreign) -> None:
    assert "| good |" in row(_fly_or_skip(foreign), "lawn", 0.0)


REPORTED = {
    "cuav-beside": "late:not-landed:approach:told",
    "cuav-other-marker": "late:not-landed:approach:decoy",
    "cuav-wind": "off:seen:wind",
    "how-other-marker": "late:not-landed:approach:decoy",
    "khairul-other-marker": "off:unseen:decoy",
    "kyujin-beside": "I:nothing:unseen:told",
    "kyujin-other-marker": "I:decoy-other-id:seen",
    "pandya-other-marker": "off:unseen:decoy",
}
"""Scenarios of docs/results/foreign-systems.md."""


@pytest.mark.sim
@pytest.mark.parametrize("name", REPORTED)
def test_scenario_of_a_bug_report_shows_the_bug(name: str) -> None:
    scenario = load(Path("lab/foreign/scenarios") / f"{name}.toml")
    foreign = next(each for each in SYSTEMS if each.name.startswith(name.partition("-")[0]))
    assert scenario.task == foreign.task
    assert flown(_fly_or_skip(foreign), scenario)[1].signature == REPORTED[name]
