"""``garl init`` writes what is missing, keeps what is there, and its tests find the class."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from pytest_garl.cli import main, skeleton
from pytest_garl.cli.init_command import SKELETON
from pytest_garl.landing_system import Land, PositionSetpoint
from tests.plugin.test_resume import SLOW
from tests.support.landing_project import CONFTEST
from tests.support.tiny_simulator import _mission, _observation


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    for name in ("my_landing", "lander", "my_stack", "my_stack_adapter"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    return tmp_path


def init(*args: str) -> Result:
    return CliRunner().invoke(main, ["init", *args])


def contents(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file() and path.suffix != ".pyc")
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def collected(folder: Path) -> str:
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "--collect-only", "-q"]
    done = subprocess.run(
        [*command, "--garl-budget=1"], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout
    return done.stdout


def test_empty_folder_gets_a_project_whose_tests_are_collected(folder: Path) -> None:
    done = init()
    assert done.exit_code == 0, done.output
    assert set(contents(folder)) == {
        "my_landing.py",
        "test_my_landing.py",
        "pytest.ini",
        ".gitignore",
    }
    assert (folder / ".gitignore").read_text() == ".garl/\n__pycache__/\n"
    assert "    garl check test_my_landing.py\n" in done.output
    assert "    pytest --garl-budget=40 test_my_landing.py\n" in done.output
    assert "test_completes_the_mission[court-g00-s00]" in collected(folder)


def test_a_script_gets_a_test_that_starts_it(folder: Path) -> None:
    pytest.importorskip("pymavlink")
    (folder / "my lander.py").write_text("import nothing_that_is_here")
    (folder / "venv" / "bin").mkdir(parents=True)
    (folder / "venv" / "bin" / "python").symlink_to(sys.executable)
    (folder / "tests").mkdir()
    (folder / "pytest.ini").write_text("[pytest]\ntestpaths = tests\n")
    done = init("my lander.py")
    assert done.exit_code == 0, done.output
    written = (folder / "tests" / "test_my_lander.py").read_text()
    assert """CompanionProgram(\n    "python 'my lander.py'",\n    folder="..",\n""" in written
    assert '    python="venv/bin/python",  # <-\n    camera=Camera(' in written
    assert "system=lander" in written
    assert '    start="ground",  # <- or "hover": ' in written
    assert "test_completes_the_mission[court-g00-s00]" in collected(folder)


@pytest.mark.parametrize(
    "line", ["python lander.py --speed 2 {marker_id}", "./lander.py -v", 'python3 -m lander "a b"']
)
def test_the_line_that_starts_a_program_is_taken_with_its_arguments(
    folder: Path, line: str
) -> None:
    pytest.importorskip("pymavlink")
    (folder / "lander.py").write_text("import nothing_that_is_here")
    done = init(line)
    assert done.exit_code == 0, done.output
    assert "    garl check test_lander.py\n" in done.output
    assert "    pytest --garl-budget=40 test_lander.py\n" in done.output
    assert "test_completes_the_mission[court-g00-s00]" in collected(folder)
    before = contents(folder)
    again = init(line)
    assert again.output.count("unchanged") == 3
    assert "    garl check test_lander.py\n" in again.output
    assert contents(folder) == before


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("gone.py", "there is no file 'gone.py' in"),
        ("python gone.py -v", "there is no file 'gone.py' in"),
        ("lander.py {marker}", "found {marker}, expected one of"),
        ("venv/bin/python lander.py", "there is no Python 'venv/bin/python'"),
        ("cargo run", "expected a Python script"),
        ("python 'lander.py", "No closing quotation"),
    ],
)
def test_a_line_that_starts_nothing_is_refused_and_nothing_is_written(
    folder: Path, line: str, message: str
) -> None:
    (folder / "lander.py").write_text("import nothing_that_is_here")
    done = init(line)
    assert done.exit_code != 0
    assert message in done.output
    assert {*contents(folder)} == {"lander.py"}


def test_second_call_changes_nothing(folder: Path) -> None:
    init()
    before = contents(folder)
    again = init()
    assert again.exit_code == 0
    assert contents(folder) == before
    assert again.output.count("unchanged") == 4
    assert init(SKELETON).exit_code == 0
    assert contents(folder) == before


def test_existing_project_keeps_all_that_it_has(folder: Path) -> None:
    (folder / "lander.py").write_text(SLOW)
    tests = folder / "tests"
    tests.mkdir()
    pyproject = (
        "[project]\r\nname = 'x'\r\n\r\n[tool.pytest.ini_options] # ours\r\n"
        "testpaths = ['tests']\r\ngarl_domain = 'calm'\r\n\r\n[tool.ruff]\r\nline-length = 99\r\n"
    )
    (folder / "pyproject.toml").write_bytes(pyproject.encode())
    (folder / ".gitignore").write_text("*.pyc")
    done = init("lander:Slow")
    assert done.exit_code == 0, done.output
    text = (folder / "pyproject.toml").read_bytes().decode()
    assert [line for line in pyproject.splitlines() if line not in text.splitlines()] == []
    settings = tomllib.loads(text)["tool"]["pytest"]["ini_options"]
    assert settings == {
        "testpaths": ["tests"],
        "garl_domain": "calm",
        "pythonpath": ["."],
    }
    assert (folder / ".gitignore").read_text() == "*.pyc\n.garl/\n"
    assert "from lander import Slow\n" in (tests / "test_lander.py").read_text()
    assert not (folder / "pytest.ini").exists()
    assert "garl check tests/test_lander.py" in done.output
    assert "tests/test_lander.py::test_lands_in_time[lawn-g00-s00]" in collected(folder)
    before = contents(folder)
    assert init("lander:Slow").exit_code == 0
    assert contents(folder) == before


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("pyproject.toml", "[project]\nname = 'x'", "\n\n[tool.pytest.ini_options]\n"),
        ("pyproject.toml", "[tool.pytest]\nstrict = true\n", "[tool.pytest]\n# where"),
        ("pytest.toml", "", "[pytest]\n# where"),
        ("tox.ini", "[tox]\na = b\n\n[pytest]\naddopts = -q\n", "[pytest]\n# where"),
        ("setup.cfg", "[tool:pytest]\naddopts = -q\n", "[tool:pytest]\n# where"),
        ("pytest.ini", "", "[pytest]\n# where"),
    ],
)
def test_settings_go_to_the_file_that_pytest_reads(
    folder: Path, name: str, text: str, expected: str
) -> None:
    (folder / name).write_text(text)
    done = init()
    assert done.exit_code == 0, done.output
    found = (folder / name).read_text()
    assert expected in found
    assert found.count("garl_domain") == 1
    made = {"pytest.ini", "pyproject.toml"} & {path.name for path in folder.iterdir()}
    assert made <= {name}
    before = contents(folder)
    init()
    assert contents(folder) == before


@pytest.mark.parametrize(
    ("name", "table"),
    [("pytest.toml", "pytest"), ("pyproject.toml", "tool.pytest"), ("pytest.ini", "pytest")],
)
def test_tests_in_a_folder_of_their_own_find_the_landing_system(
    folder: Path, name: str, table: str
) -> None:
    (folder / "tests").mkdir()
    quoted = "tests" if name.endswith(".ini") else '["tests"]'
    (folder / name).write_text(f"[{table}]\ntestpaths = {quoted}\n")
    assert init().exit_code == 0
    assert "tests/test_my_landing.py::test_lands_in_time[lawn-g00-s00]" in collected(folder)


@pytest.mark.parametrize(
    ("files", "args", "words"),
    [
        ({"my_landing.py": "x = 1\n"}, (), "my_landing.py: is here and has no class MyLanding"),
        ({}, ("lander:Missing",), "'lander:Missing': cannot be imported as a landing system"),
        ({"pyproject.toml": "[x\n"}, (), "pyproject.toml: is no valid TOML"),
        ({"pyproject.toml": "tool = {pytest = {ini_options = {}}}\n"}, (), "add these lines"),
    ],
)
def test_what_cannot_be_done_is_said_and_keeps_the_files(
    folder: Path, files: dict[str, str], args: tuple[str, ...], words: str
) -> None:
    for name, text in files.items():
        (folder / name).write_text(text)
    done = init(*args)
    assert done.exit_code == 1
    assert words in done.output
    assert {name: (folder / name).read_text() for name in files} == files


@pytest.mark.sim
def test_landing_system_to_begin_with_lands(folder: Path) -> None:
    assert init().exit_code == 0
    done = CliRunner().invoke(main, ["check", "test_my_landing.py", "--map=lawn", "--no-probes"])
    assert done.exit_code == 0, done.output
    assert done.output.count("landed 0.0") == 2
    assert (folder / "my_landing.py").read_text() == Path(skeleton.__file__).read_text()


def test_first_search_runs_after_init(folder: Path) -> None:
    """The commands that it names, with the fast simulator of the tests."""
    (folder / "lander.py").write_text(SLOW)
    (folder / "conftest.py").write_text(CONFTEST)
    assert init("lander:Slow").exit_code == 0
    command = [sys.executable, "-m", "pytest", "--garl-budget=2", "--garl-shrink=0", "-q"]
    support = Path(__file__).parents[1] / "support"
    done = subprocess.run(
        [*command, "--garl-domain=paper", "test_lander.py"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(support)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode in (0, 1), done.stdout + done.stderr
    assert "garl: violations" in done.stdout
    assert (folder / ".garl" / "ledger.sqlite").is_file()


def test_example_is_the_landing_systems_of_the_paper(folder: Path) -> None:
    done = init("--example")
    assert done.exit_code == 0, done.output
    assert "wrote      landing_systems\n" in done.output
    assert "    garl check landing_systems/test_opencv_mls.py\n" in done.output
    found = collected(folder)
    for name in ("opencv", "tphyolo", "mm"):
        assert f"test_{name}_mls.py::test_lands_in_time[court-g00-s00]" in found
    before = contents(folder)
    done = init("--example")
    assert "unchanged  landing_systems\n" in done.output
    assert contents(folder) == before


def test_example_is_no_landing_system_of_a_name(folder: Path) -> None:
    done = init("lander:Slow", "--example")
    assert done.exit_code == 1
    assert "--example: found lander:Slow too" in done.output
    assert contents(folder) == {}


STACK = """
class Pilot:
    class Lander:
        def update(self, image, altitude_m, heading_rad, velocity_ned):
            return "land" if altitude_m < 1 else (1.0, 2.0, 3.0)
"""


def test_a_class_with_another_interface_gets_an_adapter_that_flies(folder: Path) -> None:
    (folder / "my_stack.py").write_text(STACK)
    plain = init("my_stack:Pilot.Lander")
    assert "has no method 'reset'" in plain.output
    assert "garl init --adapter MODULE:CLASS" in plain.output
    assert set(contents(folder)) == {"my_stack.py"}
    done = init("--adapter", "my_stack:Pilot.Lander")
    assert done.exit_code == 0, done.output
    assert "    garl check test_my_stack_adapter.py\n" in done.output
    assert "marker=MarkerSpec(" in (folder / "test_my_stack_adapter.py").read_text()
    assert "test_lands_in_time[court-g00-s00]" in collected(folder)
    adapter = importlib.import_module("my_stack_adapter").LanderAdapter()
    adapter.reset(_mission())
    far, there = _observation(), _observation(position=(0.0, 0.0, 9.5))
    assert isinstance(adapter.step(far), PositionSetpoint)
    assert adapter.step(there).velocity_mps == (2.0, 1.0, -3.0)
    assert isinstance(adapter.step(far), Land)


def test_adapter_is_for_a_class_without_reset_and_step(folder: Path) -> None:
    assert "expected the class of your stack" in init("--adapter").output
    init()
    assert "has reset and step" in init("--adapter", SKELETON).output
    assert "cannot be imported" in init("--adapter", "no_stack:Lander").output
