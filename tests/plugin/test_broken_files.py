"""Broken files in a project: one item reports each file, and all other tests run."""

from __future__ import annotations

import os
import sqlite3
from pathlib import Path

import pytest

from pytest_garl.cases.case_file import dump_case
from tests.cases.samples import case
from tests.support.landing_project import project, run

BROKEN = {
    "nested": "nested too deeply",
    "digits": "Exceeds the limit",
    "large": "found 1000005 bytes, expected at most 1000000",
    "device": "found a device, expected a regular file",
    "pipe": "found a pipe, expected a regular file",
    "lost": "found a symbolic link that leads nowhere",
    "long": "after 0 moves, expected at most 600",
}


def _break(folder: Path) -> None:
    """Write one file of each kind that says nothing, and hangs nobody."""
    folder.mkdir(parents=True)
    text = dump_case(case()).replace("stack.landing:Lander", "systems:Good")
    (folder / "nested.toml").write_text("seed = " + "[" * 3000)
    (folder / "digits.toml").write_text("seed = " + "9" * 5000)
    (folder / "large.toml").write_text("#" * 1_000_005)
    (folder / "device.toml").symlink_to("/dev/zero")
    os.mkfifo(folder / "pipe.toml")
    (folder / "lost.toml").symlink_to("gone.toml")
    (folder / "long.toml").write_text(text.replace("[[2, 0.0", "[[20000, 0.0"))


def test_broken_case_fails_its_own_item_alone(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    _break(pytester.path / "scenarios" / "regressions" / "systems")
    result = run(pytester, "--garl-workers=0", "--garl-budget=1", "-k", "test_time", "-rA")
    result.assert_outcomes(passed=1, errors=len(BROKEN), deselected=2 * (1 + len(BROKEN)))
    for name, words in BROKEN.items():
        result.stdout.fnmatch_lines([f"* ERROR at setup of test_time?case-{name}? *"])
        result.stdout.fnmatch_lines([f"*/{name}.toml: *{words}*"])
    assert "Traceback" not in result.stdout.str() + result.stderr.str()


def test_escape_sequences_of_a_system_reach_neither_terminal_nor_report(
    pytester: pytest.Pytester,
) -> None:
    project(pytester, system="Owns")
    systems = pytester.path / "systems.py"
    hostile = r'"\x1b[2J\x1b]0;owned\x07 and \u202e turned"'
    systems.write_text(
        systems.read_text()
        + f"\nclass Owns(Good):\n    def step(self, observation): raise ValueError({hostile})\n"
    )
    folder = pytester.path / "scenarios" / "regressions" / "systems"
    folder.mkdir(parents=True)
    (folder / "lawn-\x1b[31m.toml").write_text("schema = \x1b[2J")
    xml = pytester.path / "report.xml"
    result = run(pytester, "--garl-workers=0", "--garl-budget=2", "-rA", "-v", f"--junit-xml={xml}")
    shown = result.stdout.str() + result.stderr.str() + xml.read_text()
    assert r"\x1b[2J\x1b]0;owned\x07 and \u202e turned" in shown
    assert r"lawn-\x1b[31m" in shown
    for char in "\x1b\x07\u202e":
        assert char not in shown


@pytest.mark.parametrize(
    "option", ["--garl-resume", "--garl-repeat=lawn-g00-s00"], ids=["resume", "repeat"]
)
def test_damaged_ledger_is_one_message(pytester: pytest.Pytester, option: str) -> None:
    project(pytester)
    run(pytester, "--garl-workers=0", "--garl-budget=2", "-k", "test_time")
    database = sqlite3.connect(pytester.path / ".garl" / "ledger.sqlite")
    database.execute("UPDATE slot SET result = '{\"outcome\": 3}' WHERE slot = 1")
    database.commit()
    database.close()
    budget = ["--garl-budget=2"] if option == "--garl-resume" else []
    result = run(pytester, "--garl-workers=0", "-k", "test_time", option, *budget)
    output = result.stdout.str() + result.stderr.str()
    assert "ledger.sqlite: is damaged or no ledger of this version: slot 0/1" in output
    assert "Traceback" not in output
    assert result.ret != 0


@pytest.mark.parametrize(
    ("text", "words"),
    [("seed = " + "[" * 3000, "nested too deeply"), ("\x00", "not valid TOML")],
    ids=["nested", "null"],
)
def test_unreadable_scenario_is_one_message(
    pytester: pytest.Pytester, text: str, words: str
) -> None:
    project(pytester)
    (pytester.path / "one.toml").write_text(text)
    result = run(pytester, "--garl-workers=0", "--garl-repeat=one.toml")
    (line,) = [each for each in result.stderr.lines if "one.toml" in each]
    assert words in line
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    assert "Traceback" not in result.stdout.str() + result.stderr.str()


def test_unreadable_baseline_is_one_message(pytester: pytest.Pytester) -> None:
    project(pytester)
    (pytester.path / "base.toml").write_text("cpu = " + "[" * 3000)
    result = run(pytester, "--garl-workers=0", "--garl-baseline=base.toml")
    result.stderr.fnmatch_lines(["ERROR: --garl-baseline: *base.toml: *nested too deeply*"])
    assert result.ret == pytest.ExitCode.USAGE_ERROR


SPOILS = """
import pathlib
import sqlite3
import pytest

@pytest.hookimpl(tryfirst=True)
def {hook}(session):
    with sqlite3.connect(pathlib.Path(session.config.rootpath, ".garl", "ledger.sqlite")) as db:
        db.execute("DROP TABLE slot")
"""


@pytest.mark.parametrize("hook", ["pytest_sessionfinish", "pytest_runtestloop"])
def test_ledger_that_breaks_in_use_is_one_message(pytester: pytest.Pytester, hook: str) -> None:
    project(pytester)
    conftest = pytester.path / "conftest.py"
    conftest.write_text(conftest.read_text() + SPOILS.format(hook=hook))
    result = pytester.runpytest_subprocess(
        "-p", "no:cacheprovider", "--garl-workers=0", "--garl-budget=2", "-k", "test_time"
    )
    output = result.stdout.str() + result.stderr.str()
    assert "ledger.sqlite: " in output
    assert "Traceback" not in output
    assert "INTERNALERROR" not in output
    assert result.ret == pytest.ExitCode.INTERNAL_ERROR
