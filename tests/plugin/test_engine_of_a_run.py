"""A run by another physics engine: what it says and refuses, and what saved cases mean there."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from pytest_garl.cases.case_file import load_case
from pytest_garl.engine import VARIABLE
from tests.support.case_project import cases, let_system_avoid_dog, replace_text, run
from tests.support.engines import NEEDS_MUJOCO
from tests.support.landing_project import project

MUJOCO = ("-o", "garl_engine=mujoco", "--garl-workers=0")
SEARCH = ("--garl-budget=4", "--garl-shrink=0", "--garl-map=lawn")
pytestmark = NEEDS_MUJOCO


@pytest.fixture(autouse=True)
def no_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)


def _garl(project: pytest.Pytester, *args: str) -> pytest.RunResult:
    return project.run(sys.executable, "-c", "import pytest_garl.cli as c; c.main()", *args)


def _case(searched: pytest.Pytester, what: str) -> Path:
    (found,) = [path for path in cases(searched) if path.name.startswith(f"lawn-{what}")]
    return found


def test_a_ledger_of_one_engine_is_not_continued_by_another(pytester: pytest.Pytester) -> None:
    project(pytester, maps="['lawn']")
    first = run(pytester, *SEARCH, *MUJOCO)
    first.stdout.fnmatch_lines(["garl: budget 4 *, engine mujoco, *"])
    resumed = run(pytester, *SEARCH, "--garl-resume", *MUJOCO)
    resumed.stdout.fnmatch_lines(["garl: resuming after 4 flights; *, engine mujoco, *"])
    other = run(pytester, *SEARCH, "--garl-resume", "-o", "garl_engine=bullet")
    assert other.ret == pytest.ExitCode.USAGE_ERROR
    other.stderr.fnmatch_lines(["*belongs to another run: engine was mujoco, is bullet*"])


def test_an_engine_that_nobody_knows_ends_the_run_before_its_ledger(
    pytester: pytest.Pytester,
) -> None:
    project(pytester, maps="['lawn']")
    result = run(pytester, *SEARCH, "-o", "garl_engine=unity")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*garl_engine: found 'unity', expected one of auto, bullet*"])
    assert not (pytester.path / ".garl" / "ledger.sqlite").exists()


def test_a_case_names_its_engine_and_one_of_bullet_does_not(
    searched: pytest.Pytester,
) -> None:
    dog = _case(searched, "IV-dog")
    assert "engine" not in dog.read_text()
    replace_text(dog, "map_sha256", 'engine = "mujoco"\nmap_sha256')
    case = load_case(dog)
    assert case.evidence.engine == "mujoco"
    assert case.of_another_engine == "Bullet flies here, and its reference is MuJoCo's"
    # It is no part of the name.
    assert case.id == dog.stem


def test_a_known_case_fails_as_expected_on_another_engine(searched: pytest.Pytester) -> None:
    result = run(searched, *MUJOCO)
    assert result.ret == pytest.ExitCode.OK
    assert result.parseoutcomes()["xfailed"] >= 2


def test_a_case_that_passes_on_another_engine_is_neither_fixed_nor_stale(
    searched: pytest.Pytester,
) -> None:
    let_system_avoid_dog(searched.path)
    dog = _case(searched, "IV-dog").name
    result = run(searched, *MUJOCO, "-o", "garl_xfail_strict=true")
    assert result.ret == pytest.ExitCode.OK
    result.stdout.fnmatch_lines([f"passes on another engine: *{dog}: MuJoCo flies here, *"])
    result.stdout.no_fnmatch_line("maybe fixed: *")
    result.stdout.no_fnmatch_line("stale: *")
    own = run(searched)
    own.stdout.fnmatch_lines([f"maybe fixed: *{dog} passes; *"])


def test_a_case_gates_on_its_own_engine_only(searched: pytest.Pytester) -> None:
    dog = _case(searched, "IV-dog")
    replace_text(dog, 'status = "open"', 'status = "fixed"')
    own = run(searched)
    assert own.ret == pytest.ExitCode.TESTS_FAILED
    result = run(searched, *MUJOCO, "-rx")
    assert result.ret == pytest.ExitCode.OK
    result.stdout.fnmatch_lines(["*another engine: fails by IV:dog*"])


# The longest of all tests but this mark: five commands, each of which flies or starts pytest.
@pytest.mark.long
def test_commands_decide_by_the_engine_of_the_case(
    searched: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    dog = str(_case(searched, "IV-dog").relative_to(searched.path))
    let_system_avoid_dog(searched.path)
    monkeypatch.setenv(VARIABLE, "mujoco")
    replayed = _garl(searched, "cases", "replay", dog)
    assert replayed.ret == 3
    replayed.stdout.fnmatch_lines(["UNDECIDED", "it passes on another engine: MuJoCo flies here,*"])
    promoted = _garl(searched, "cases", "promote", dog)
    assert promoted.ret == 1
    promoted.stderr.fnmatch_lines(
        ["*is not decided with its recorded moves: it passes on another*"]
    )
    assert _garl(searched, "cases", "prune", "--yes").ret == 0
    renewed = _garl(searched, "cases", "renew", "--workers=0")
    renewed.stderr.fnmatch_lines(["*reference is Bullet's: renew it with garl_engine = bullet"])
    assert (searched.path / dog).exists()
    # The project's own word counts more.
    (searched.path / "pytest.ini").write_text(
        (searched.path / "pytest.ini").read_text() + "garl_engine = bullet\n"
    )
    assert _garl(searched, "cases", "promote", dog).ret == 0


def test_a_baseline_is_no_gate_for_another_engine(pytester: pytest.Pytester) -> None:
    project(pytester, maps="['lawn']")
    search = ("--garl-budget=4", "--garl-method=random", "--garl-shrink=0")
    run(pytester, *search, *MUJOCO)
    saved = _garl(
        pytester, "baseline", "save", "--from-ledger", ".garl/ledger.sqlite", "--out", "base.toml"
    )
    assert saved.ret == 0
    # What flew is in the ledger, what saves need not have it.
    assert '"mujoco" = ' in (pytester.path / "base.toml").read_text()
    report = _garl(pytester, "report", "--json")
    assert json.loads(report.stdout.str())["run"]["engine"] == "mujoco"
    gate = ("--garl-baseline=base.toml", "--garl-workers=0")
    assert run(pytester, *gate, "-o", "garl_engine=mujoco").ret == pytest.ExitCode.OK
    other = run(pytester, *gate, "-o", "garl_engine=bullet")
    assert other.ret == pytest.ExitCode.USAGE_ERROR
    other.stderr.fnmatch_lines(["*found a baseline of the physics engine mujoco, expected one of*"])
