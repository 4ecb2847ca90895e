"""The hash of the code that flies and judges a case: what changes it, and what does not."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from pytest_garl.execution import sources
from pytest_garl.execution.reference import Reference, simulator_sha256
from pytest_garl.execution.sources import code_sha256, flown_modules


def fresh() -> str:
    """Hash the package; within a process that is done once."""
    sources.flight_code_sha256.cache_clear()
    return sources.flight_code_sha256()


@pytest.fixture(scope="module")
def here() -> str:
    """Return the hash of this package."""
    return fresh()


@pytest.fixture
def copy(here: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return a copy of this package that is hashed in its place."""
    home = Path(sources.__file__).parents[1]
    shutil.copytree(
        home, tmp_path / "pytest_garl", ignore=shutil.ignore_patterns("__pycache__", "*.npz")
    )
    assert re.fullmatch("[0-9a-f]{64}", here)
    monkeypatch.setattr(sources, "_HOME", tmp_path / "pytest_garl")
    yield tmp_path / "pytest_garl"
    sources.flight_code_sha256.cache_clear()


def test_comments_docstrings_and_layout_do_not_matter(copy: Path, here: str) -> None:
    path = copy / "simulation" / "loop.py"
    text = path.read_text()
    assert text.startswith('"""')
    path.write_text('"""Another docstring."""\n\n# A comment.\n\n\n' + text.partition('"""\n')[2])
    assert fresh() == here
    path.write_text(text + "\nEXTRA = 1\n")
    assert fresh() != here


def test_what_flies_and_judges_no_case_does_not_matter(copy: Path, here: str) -> None:
    for file in (
        "__init__.py",
        "messages.py",
        "npcs/learned.py",
        "execution/severity.py",
        "execution/worker.py",
        "plugin/terminal/summary.py",
        "shrinking/shrink.py",
        "scenarios/domains/field.toml",
        "search/breeder.py",
    ):
        path = copy / file
        path.write_text(path.read_text() + "\nEXTRA = 1\n")
    assert fresh() == here


@pytest.mark.parametrize("file", ["verdicts/margins.py", "simulation/physics/unit_ball.obj"])
def test_what_flies_or_judges_a_case_matters(copy: Path, here: str, file: str) -> None:
    path = copy / file
    path.write_text(path.read_text() + "\nEXTRA = 1\n")
    assert fresh() != here


def test_physics_camera_recorded_moves_and_verdicts_fly_and_judge() -> None:
    assert {
        "pytest_garl.npcs.recorded",
        "pytest_garl.scenarios.placed",
        "pytest_garl.simulation.camera.renderer",
        "pytest_garl.simulation.physics.wind",
        "pytest_garl.verdicts.excuses",
    } <= flown_modules()


def test_no_module_of_the_search_or_of_pytest_flies() -> None:
    rooms = {name.split(".")[1] for name in flown_modules()}
    assert rooms <= {
        *("airframe", "commands", "cpu_dispatch", "distortion", "engine", "fiducial", "files"),
        *(
            "flight",
            "foreign_text",
            "landing_system",
            "npcs",
            "program",
            "scenarios",
            "simulation",
            "verdicts",
        ),
    }


def test_the_hash_of_a_projects_own_simulator_is_that_of_its_code(tmp_path: Path) -> None:
    file = tmp_path / "own.py"
    own = Reference(module="own", file=str(file), qualname="fly")
    file.write_text("def fly():\n    return 1\n")
    before = simulator_sha256(own)
    file.write_text('"""Mine."""\n\ndef fly():  # a comment\n    """Fly."""\n    return  1\n')
    assert simulator_sha256(own) == before
    file.write_text("def fly():\n    return 2\n")
    assert simulator_sha256(own) != before


def test_code_that_cannot_be_parsed_is_hashed_by_its_bytes(tmp_path: Path) -> None:
    file = tmp_path / "own.so"
    file.write_bytes(b"\x7fELF\0 one")
    before = code_sha256(file)
    file.write_bytes(b"\x7fELF\0 two")
    assert code_sha256(file) != before
