from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pytest_garl.execution.ray.actor import PathMapping
from pytest_garl.execution.reference import Reference
from pytest_garl.simulation.npc_policy import PolicySpec
from tests.execution.flying import Good, job_of

PATHS = PathMapping(local="/home/ann/stack", remote="/tmp/ray/_ray_pkg_1f")


def test_job_gets_the_paths_of_the_copy() -> None:
    job = dataclasses.replace(
        job_of(Good, Path("/home/ann/stack/.garl/flights")),
        system=Reference(module="mine", file="/home/ann/stack/src/mine.py", qualname="Mine"),
        map_folders=("/home/ann/stack/scenarios/maps",),
        npcs=PolicySpec(
            name="a.npz", factory="m:f", arguments=(("weights", "/home/ann/stack/a.npz"),)
        ),
        path=("/home/ann/stack", "/usr/lib/python3.11", "/srv/home/ann/stack", "/home/ann/stack2"),
    )
    found = PATHS.remote_job(job.dumps())
    assert found.system.file == "/tmp/ray/_ray_pkg_1f/src/mine.py"
    assert found.map_folders == ("/tmp/ray/_ray_pkg_1f/scenarios/maps",)
    assert dict(found.npcs.arguments) == {"weights": "/tmp/ray/_ray_pkg_1f/a.npz"}
    # Only whole paths below the project change.
    assert found.path == ("/tmp/ray/_ray_pkg_1f", *job.path[1:])


def test_files_outside_the_project_are_imported_by_name() -> None:
    job = job_of(Good, Path("flights"))
    assert job.system.file
    found = PATHS.remote_job(job.dumps())
    assert found.system == dataclasses.replace(job.system, file="")
    assert found.simulator == dataclasses.replace(job.simulator, file="")


def test_folder_may_have_any_name() -> None:
    home = '/home/jörg/a "b" (c)+'
    job = dataclasses.replace(job_of(Good, Path("flights")), path=(home, f"{home}/src"))
    moved = PathMapping(local=home, remote="/a\\b")
    assert moved.remote_job(job.dumps()).path == ("/a\\b", "/a\\b/src")


@pytest.mark.parametrize(
    ("here", "home"),
    [
        (
            '  File "/tmp/ray/_ray_pkg_1f/mine.py", line 3',
            '  File "/home/ann/stack/mine.py", line 3',
        ),
        ("no /tmp/ray/_ray_pkg_1f there", "no /home/ann/stack there"),
        ("/tmp/ray/_ray_pkg_1f2", "/tmp/ray/_ray_pkg_1f2"),
    ],
)
def test_traceback_gets_local_paths(here: str, home: str) -> None:
    assert PATHS.to_local(here) == home
