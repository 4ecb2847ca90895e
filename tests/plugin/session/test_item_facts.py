from __future__ import annotations

import pytest

from tests.support.case_project import (
    SEARCH,
    replace_text,
    run,
)
from tests.support.landing_project import project

FLAKY = (*SEARCH, "--garl-method=random", "--garl-shrink=0", "-rxf")


def hit_by_the_dog(pytester: pytest.Pytester, when: str) -> None:
    """Let the dog hit a system only in some of a scenario's flights in one process."""
    simulator = pytester.path / "tiny_simulator.py"
    # In the fog it would fail each time, in one way or the other.
    replace_text(simulator, '["environment.fog"] > 0.1', '["environment.fog"] > 1')
    replace_text(
        simulator,
        "and not knows:\n        outcome",
        f"and not knows and {when}:\n        outcome",
    )
    replace_text(
        simulator, "    contacts: tuple", "    SEEN.append(scenario.seed)\n    contacts: tuple"
    )
    replace_text(simulator, "\n\ndef fly(", "\n\nSEEN = ['']\n\n\ndef fly(")


def test_nondeterministic_system_is_reported(pytester: pytest.Pytester) -> None:
    project(pytester)
    simulator = pytester.path / "tiny_simulator.py"
    replace_text(simulator, "else off", "else off\n    off += 1e-6 * __import__('random').random()")
    result = run(pytester, *SEARCH, "--garl-shrink=0")
    lines = ["Nondeterministic landing system: *", "*trajectories, from * s on*"]
    result.stdout.fnmatch_lines(lines)
    assert result.ret == pytest.ExitCode.TESTS_FAILED


@pytest.mark.parametrize("marked", [True, False])
def test_violation_in_three_of_five_flights_is_flaky(
    pytester: pytest.Pytester, marked: bool
) -> None:
    project(pytester)
    if marked:
        replace_text(pytester.path / "test_it.py", "maps=", "deterministic=False, maps=")
    hit_by_the_dog(pytester, "SEEN.count(scenario.seed) % 2 == 1")
    result = run(pytester, *FLAKY)
    assert result.parseoutcomes()["failed"] == 1
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["FLAKY: 3 of 5 flights fail [[]*, *[]] %*"])
    assert ("Nondeterministic landing system" in result.stdout.str()) is not marked


def test_violation_in_one_of_five_flights_fails_no_item(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    replace_text(pytester.path / "test_it.py", "maps=", "deterministic=False, maps=")
    hit_by_the_dog(pytester, "SEEN.count(scenario.seed) == 1")
    result = run(pytester, *FLAKY)
    assert "failed" not in result.parseoutcomes()
    assert result.parseoutcomes()["xfailed"] >= 1
    result.stdout.fnmatch_lines(
        [
            "Good on lawn: * violations in 24 flights did not repeat, at most 1 may:*",
            "*did not repeat: 1 of 5 flights fail [[]*[]] % (IV:dog*",
        ]
    )
    assert result.ret == pytest.ExitCode.TESTS_FAILED
