"""While a search runs it tells each new kind when it is found, and when it is shrunk."""

from __future__ import annotations

import dataclasses
import re

import pytest

from pytest_garl.execution.severity import Severity
from pytest_garl.plugin.terminal.kind_news import _shrunk
from pytest_garl.shrinking.case_request import CaseResult
from tests.cases.samples import case, make_case_request
from tests.plugin.terminal.test_progress_line import on_a_terminal, screen
from tests.support.landing_project import project, run

SEARCH = ("--garl-budget=16", "--garl-workers=1", "--tb=no")
FOUND = "garl: found IV:dog:last-metre:unseen: collided with dog-1 at 1.0 m/s, 0.0 m up, 3.0 m east"
SAVED = " (its case is saved when the run ends)"
PARALLEL = pytest.mark.parametrize(
    "parallel", [(), pytest.param(("-n2",), marks=pytest.mark.long)], ids=["alone", "xdist"]
)


@PARALLEL
def test_each_new_kind_is_told_once_before_the_summary(
    pytester: pytest.Pytester, parallel: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    project(pytester)
    monkeypatch.setenv("COLUMNS", "200")
    text = run(pytester, *SEARCH, "--garl-shrink=12", *parallel).stdout.str()
    before, _, after = text.partition("= garl: violations =")
    assert before.count(FOUND) == 1
    assert "garl: found" not in after
    assert re.search(r"\n +\d+  IV:dog:last-metre:unseen", after)
    (shrunk,) = re.findall(r"^garl: shrunk IV:dog:last-metre:unseen .*$", before, re.M)
    told = "garl: shrunk IV:dog:last-metre:unseen (Good on lawn): Collided with dog-1 at 1.0 m/s"
    assert shrunk.removesuffix(SAVED) == told
    assert before.count(SAVED) == 1
    assert text.index("garl: found IV:dog") < text.index("garl: shrunk IV:dog")
    header = "garl: `garl report` in a second terminal shows what was found so far"
    assert header in text.splitlines()


def test_kinds_of_saved_cases_are_not_told(searched: pytest.Pytester) -> None:
    text = run(searched, *SEARCH).stdout.str()
    assert "IV:dog:last-metre:unseen" in text
    assert "garl: found IV:dog:last-metre:unseen" not in text


def test_a_resumed_run_says_which_kinds_were_found_earlier(pytester: pytest.Pytester) -> None:
    project(pytester)
    search = (*SEARCH, "--garl-shrink=0")
    assert "garl: found IV:dog:last-metre:unseen" in run(pytester, *search).stdout.str()
    resumed = run(pytester, *search, "--garl-resume").stdout.str()
    assert "garl: found earlier IV:dog:last-metre:unseen" in resumed
    assert "garl: found IV" not in resumed


def test_repeated_scenario_and_quiet_run_tell_nothing(pytester: pytest.Pytester) -> None:
    project(pytester)
    assert "garl: found" not in run(pytester, *SEARCH, "-q").stdout.str()
    again = run(pytester, "--garl-repeat=lawn-g00-s02", "--tb=no").stdout.str()
    assert "1 failed" in again
    assert "garl: found" not in again
    assert "second terminal" not in again


@PARALLEL
def test_on_a_terminal_news_stand_above_the_progress_line(
    pytester: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    project(pytester)
    written = on_a_terminal(pytester, *SEARCH, "--garl-shrink=12", *parallel)
    rows = [row.rstrip() for row in screen(written)]
    assert "garl: found IV:dog:last-metre:unseen: collided with dog-1 at" in rows
    assert any(row.startswith("garl: shrunk IV:dog:last-metre:unseen") for row in rows)
    assert not any(row.startswith("garl [") for row in rows)


def test_other_folder_stands_in_the_command_of_the_header(pytester: pytest.Pytester) -> None:
    project(pytester)
    text = run(pytester, "--garl-budget=1", "-o", "garl_dir=a b").stdout.str()
    assert "garl: `garl report 'a b/ledger.sqlite'` in a second terminal" in text


def shrunk(description: str, untried: tuple[str, ...] = ()) -> str:
    """Return what is told of a violation by fog, with its neighbours flown."""
    severity = Severity(about="conditions", conditions=("fog",), values=("",), untried=untried)
    made = dataclasses.replace(case("II:never-seen", description), severity=severity)
    result = CaseResult(signature="II:never-seen", case=made, flights=4)
    return _shrunk(make_case_request(12), result).partition(": ")[2]


def test_a_violation_is_shrunk_only_if_flights_showed_what_it_takes() -> None:
    told = shrunk("Unusual in this flight: fog. Not landed. At 9.0 s it was up.", ("fog",))
    assert told.startswith("confirmed, not shrunk II:never-seen (")
    assert told.endswith("): Unusual in this flight: fog. Not landed")
    told = shrunk("Fog alone: Not landed. At 9.0 s it was up.")
    assert told.startswith("shrunk II:never-seen (")
    assert told.endswith("): Fog alone: Not landed")
