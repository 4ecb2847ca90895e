"""Cases that pytest judges: by the tests of the project that found them."""

from __future__ import annotations

import dataclasses
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from pytest_garl.cases.case_file import load_case
from pytest_garl.cases.corpus import replace_file
from pytest_garl.cli import main
from pytest_garl.execution.reference import Reference, simulator_sha256
from tests.support.case_project import USER_PROPERTY_TEST, let_system_avoid_dog, replace_text
from tests.support.landing_project import write_project

SEARCH = ("--garl-budget=24", "--garl-workers=0", "--garl-shrink=60")
CLOCK = """

def test_clock(landing):
    assert landing.elapsed_s < 100
"""


@pytest.fixture(scope="module")
def template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a project with three saved cases: a dog, fog, and a property of its own."""
    folder = tmp_path_factory.mktemp("judged")
    write_project(folder)
    tests = folder / "test_it.py"
    tests.write_text(tests.read_text() + USER_PROPERTY_TEST + CLOCK)
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *SEARCH]
    subprocess.run(command, cwd=folder, capture_output=True, check=False)
    assert len(list((folder / "scenarios/regressions/systems").glob("*.toml"))) == 3
    return folder


@pytest.fixture
def project(template: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a copy of it in which the test runs."""
    shutil.copytree(template, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def garl(*args: str | Path) -> Result:
    return CliRunner().invoke(main, ["cases", *map(str, args)], env={"COLUMNS": "200"})


def shrunk(file: Path, flights: int, *more: str) -> str:
    """Shrink a case in a process of its own, as a user does: it imports the project's tests."""
    start = "from pytest_garl.cli import main; main()"
    command = [sys.executable, "-c", start, "cases", "shrink", str(file)]
    options = [f"--flights={flights}", "--workers=0", *more]
    done = subprocess.run([*command, *options], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_a_case_of_a_simulator_of_the_project_has_no_film(project: Path) -> None:
    start = "from pytest_garl.cli import main; main()"
    command = [sys.executable, "-c", start, "film", saved(project, "IV-dog").stem]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "flown by tiny_simulator:fly, a simulator of your own" in done.stderr
    assert "flying" not in done.stdout
    assert not list(project.glob("*.mp4"))


def saved(project: Path, kind: str) -> Path:
    (path,) = (project / "scenarios/regressions/systems").glob(f"lawn-{kind}-*.toml")
    return path.relative_to(project)


def test_promote_accepts_a_repaired_system(project: Path) -> None:
    dog = saved(project, "IV-dog")
    failed = garl("replay", dog)
    assert failed.output.startswith("FAILED\nIV:dog:")
    assert "test_collisions: " in failed.output
    assert "the same flight to the byte" in failed.output
    assert failed.exit_code == 1
    assert "still fails with its recorded moves (IV:dog:" in garl("promote", dog).output
    let_system_avoid_dog(project)
    fixed = garl("replay", dog)
    assert fixed.output.startswith("FIXED\nno violation")
    assert "judged by test_it.py::test_collisions" in fixed.output
    assert fixed.exit_code == 0
    assert "fixed; from now on it must pass" in garl("promote", dog).output
    assert load_case(dog).status == "fixed"


def test_own_test_judges_an_own_property(project: Path) -> None:
    own = saved(project, "own")
    failed = garl("replay", own)
    assert failed.output.startswith("FAILED\n")
    assert "test_own: AssertionError: too much snow" in failed.output
    assert "still fails" in garl("promote", own).output
    assert load_case(own).status == "open"


def test_prune_keeps_cases_that_fail_in_their_own_test(project: Path) -> None:
    own = saved(project, "own")
    replace_text(own, 'map_sha256 = "', 'map_sha256 = "0')
    before = own.read_text()
    assert "3 cases are not stale" in garl("prune", "--yes").output
    assert own.read_text() == before


def test_case_of_an_older_file_finds_its_test_by_name(project: Path) -> None:
    own = saved(project, "own")
    replace_text(own, '"test_it.py::test_own"', '"test_own"')
    assert garl("replay", own).output.startswith("FAILED\n")


def test_pass_on_a_changed_simulator_is_stale(project: Path) -> None:
    dog = saved(project, "IV-dog")
    replace_text(project / "tiny_simulator.py", "> 0.7 and", "> 7 and")
    stale = garl("replay", dog)
    assert stale.output.startswith("STALE\nno violation")
    assert "the simulator has changed" in stale.output
    assert stale.exit_code == 3
    assert "passes, but is stale with its recorded moves" in garl("promote", dog).output
    assert load_case(dog).status == "open"
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "--garl-workers=0"],
        cwd=project,
        capture_output=True,
        text=True,
        check=False,
    )
    assert f"stale: {dog} passes, but the simulator has changed" in done.stdout
    assert "maybe fixed" not in done.stdout
    assert f"{dog}: passes, but the simulator has changed" in garl("prune", "--yes").output
    assert not dog.exists()


def test_weaker_test_does_not_make_a_case_fixed(project: Path) -> None:
    dog = saved(project, "IV-dog")
    replace_text(project / "test_it.py", "assert not landing.collisions", "assert True")
    assert "the recorded one to the byte" in garl("replay", dog).output
    assert "is stale" in garl("promote", dog).output
    assert load_case(dog).status == "open"


def test_failure_of_another_test_of_the_file_keeps_a_case_open(project: Path) -> None:
    dog = saved(project, "IV-dog")
    let_system_avoid_dog(project)
    replace_text(project / "test_it.py", "< 100", "< 1")
    assert "still fails with its recorded moves" in garl("promote", dog).output


@pytest.mark.parametrize("outcome", ["gave_up", "inconclusive"])
def test_promote_reports_an_abort_and_refuses_an_undecided_case(
    project: Path, outcome: str
) -> None:
    dog = saved(project, "IV-dog")
    let_system_avoid_dog(project)
    end = "    flight = Flight(\n"
    simulator = project / "tiny_simulator.py"
    if outcome == "gave_up":
        replace_text(simulator, end, f"    outcome = 'gave_up'\n{end}")
        simulator_is_as_it_was(dog)
        limits = f"system=Good, {ALLOWED}, "
        replace_text(project / "test_it.py", "system=Good, ", limits)
        output = garl("promote", dog).output
        assert "with its recorded moves the landing system gave up, which its limits" in output
        assert load_case(dog).status == "fixed"
    else:
        replace_text(project / "test_it.py", "not landing.collisions", "landing.time_to_landing_s")
        replace_text(simulator, end, f"    outcome, contacts = 'collision', {CONTACT}\n{end}")
        simulator_is_as_it_was(dog)
        assert "is not decided with its recorded moves" in garl("promote", dog).output
        assert load_case(dog).status == "open"


ALLOWED = "limits={'abort': 'ok'}"
CONTACT = (
    "(Contact(time_s=1.0, body='tree', kind='tree', body_class='static', "
    "position_m=(0.0, 0.0, 1.0), speed_mps=1.0, tilt_rad=0.0),)"
)


def simulator_is_as_it_was(file: Path) -> None:
    """Let a case have been saved with the simulator of today."""
    simulator = Reference(module="tiny_simulator", file="tiny_simulator.py", qualname="fly")
    case = load_case(file)
    evidence = dataclasses.replace(case.evidence, simulator_sha256=simulator_sha256(simulator))
    replace_file(file, dataclasses.replace(case, evidence=evidence))


def test_built_in_verdict_judges_a_case_without_its_test(project: Path) -> None:
    dog = saved(project, "IV-dog")
    replace_text(project / "test_it.py", "def test_collisions", "def test_hits")
    replayed = garl("replay", dog)
    assert "judged by the built-in verdict: the test test_it.py::test_collisions" in replayed.output


def test_file_that_cannot_be_collected_gives_one_clear_error(project: Path) -> None:
    replace_text(project / "test_it.py", "import pytest", "import pytestt")
    result = garl("replay", saved(project, "IV-dog"))
    assert "pytest could not fly the case" in result.output
    assert "No module named 'pytestt'" in result.output
    assert result.exit_code == 1


def test_shrink_uses_the_test_of_an_own_property(project: Path) -> None:
    own = saved(project, "own")
    case = load_case(own)
    foggy = case.scenario.replace({"environment.dust": 0.1, "environment.snow": 0.14})
    file = replace_file(own, dataclasses.replace(case, scenario=foggy))
    shrunk(file, 30)
    better = load_case(saved(project, "own"))
    assert better.scenario["environment.dust"] == 0.0
    assert 0.1 <= better.scenario["environment.snow"] <= 0.14
    assert (better.test, better.assertion) == (case.test, case.assertion)
    assert garl("replay", saved(project, "own")).output.startswith("FAILED")


def test_shrink_works_if_warnings_are_errors(project: Path) -> None:
    (project / "pytest.ini").write_text("[pytest]\nfilterwarnings = error\n")
    assert "flights)" in shrunk(saved(project, "IV-dog"), 9)


def test_shrink_keeps_the_simplest_case(project: Path) -> None:
    dog = saved(project, "IV-dog")
    shrunk(dog, 60)
    dog = saved(project, "IV-dog")
    before = dog.read_bytes()
    output = shrunk(dog, 30)
    assert "nothing simpler was found" in output
    assert output.endswith("it stays as it is\n")
    assert saved(project, "IV-dog").read_bytes() == before


def test_shrink_makes_a_case_of_how_it_fails_today_if_asked(project: Path) -> None:
    replace_text(project / "tiny_simulator.py", 'outcome = "collision"', 'outcome = "gave_up"')
    dog = saved(project, "IV-dog")
    assert "does not fail in the same way" in garl("shrink", dog, "--workers=0").output
    output = shrunk(dog, 12, "--as-it-fails")
    assert re.search(r"now a case of II:\S+, which was one of IV:dog:", output)
    assert not (project / dog).exists()
    case = load_case(saved(project, "II"))
    assert (case.status, case.violation.type) == ("open", "II")
    assert garl("replay", saved(project, "II")).output.startswith("FAILED\nII:")


def test_only_an_open_case_becomes_one_of_how_it_fails(project: Path) -> None:
    dog = saved(project, "IV-dog")
    replace_file(dog, dataclasses.replace(load_case(dog), status="fixed"))
    assert "a fixed case must pass" in garl("shrink", dog, "--as-it-fails").output
    own = garl("shrink", saved(project, "own"), "--as-it-fails")
    assert "an assertion judges it" in own.output


@pytest.mark.parametrize("flights", ["0", "8", "-3"])
def test_shrink_refuses_too_few_flights(project: Path, flights: str) -> None:
    result = garl("shrink", saved(project, "IV-dog"), f"--flights={flights}")
    assert result.exit_code == 2
    assert "--flights" in result.output


def test_check_names_a_test_without_file(project: Path) -> None:
    assert garl("check").exit_code == 0
    replace_text(saved(project, "IV-dog"), '"test_it.py::', '"test_that.py::')
    checked = garl("check")
    assert "key 'test': there is no file" in checked.output
    assert checked.exit_code == 1
