"""An airframe's navigation bounds what a search draws."""

from __future__ import annotations

import pytest

from pytest_garl.execution.ledger import Ledger
from pytest_garl.scenarios.files import parse_scenario
from tests.support.landing_project import project, run

SYSTEM = """
from pytest_garl import Airframe
class Corrected(Good):
    airframe = Airframe(navigation="{navigation}")
class Broken(type):
    @property
    def airframe(cls): raise ZeroDivisionError("no airframe")
class Odd(Good, metaclass=Broken):
    pass
"""
DOMAIN = 'extends = "calm"\n[navigation]\nposition_m = [{low}, 2.5]\n'


def corrected(pytester: pytest.Pytester, navigation: str = "rtk", low: float = 0.0) -> None:
    project(pytester, system="Corrected")
    systems = pytester.path / "systems.py"
    systems.write_text(systems.read_text() + SYSTEM.format(navigation=navigation))
    (pytester.path / "mine.toml").write_text(DOMAIN.format(low=low))


def drawn_m(pytester: pytest.Pytester) -> list[float]:
    """Return the navigation errors of all flights."""
    ledger = Ledger(pytester.path / ".garl" / "ledger.sqlite")
    try:
        return [
            parse_scenario(row.scenario)["navigation.position_m"]
            for search, _ in ledger.searches()
            for row in ledger.queries.flights(search)
        ]
    finally:
        ledger.close()


def test_a_search_draws_no_larger_errors_than_the_airframe_has(pytester: pytest.Pytester) -> None:
    corrected(pytester)
    result = run(pytester, "--garl-budget=40", "--garl-domain=mine.toml", "--garl-workers=0")
    result.stdout.fnmatch_lines(["garl: navigation of Corrected: rtk, which bounds the domain's"])
    found = drawn_m(pytester)
    assert len(found) == 40
    assert 0 < max(found) <= 0.02


def test_a_domain_that_contradicts_the_airframe_is_one_error(pytester: pytest.Pytester) -> None:
    corrected(pytester, navigation="ideal", low=1.0)
    result = run(pytester, "--garl-budget=4", "--garl-domain=mine.toml", "--garl-workers=0")
    result.stdout.fnmatch_lines(["*'mine': navigation.position_m begins at 1, but a vehicle with*"])
    result.assert_outcomes(errors=1)


def test_an_airframe_that_raises_is_a_finding_of_the_flights(pytester: pytest.Pytester) -> None:
    corrected(pytester)
    tests = pytester.path / "test_it.py"
    tests.write_text(tests.read_text().replace("system=Corrected", "system=Odd"))
    result = run(pytester, "--garl-budget=2", "--garl-domain=mine.toml", "--garl-workers=0")
    assert result.ret in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED)
    assert len(drawn_m(pytester)) == 2
