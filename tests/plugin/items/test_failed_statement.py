"""Which statement of a test failed, and what it is about."""

from __future__ import annotations

import linecache
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from pytest_garl.cases.user_failure import UserFailure
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.plugin.items.failed_statement import failure_of
from pytest_garl.plugin.items.landing import Landing
from pytest_garl.plugin.items.outcomes import is_about
from tests.support.results import flight_result

RESULT = flight_result(
    "IV:dog:last-metre:unseen",
    final_distance_m=3.0,
    elapsed_s=14.0,
    collisions=("dog-1",),
    undecided="collision",
    story="Collided with dog-1.",
)


def failing(tmp_path: Path, body: str, helpers: str = "") -> UserFailure | None:
    """Return which assertion of a test with that body fails."""
    file = tmp_path / "test_it.py"
    lines = "".join(f"    {line}\n" for line in body.splitlines())
    file.write_text(f"import pytest\n{helpers}\ndef test_it(landing):\n{lines}")
    linecache.checkcache()
    space: dict[str, Any] = {}
    exec(compile(file.read_text(), str(file), "exec"), space)
    test: Callable[[Landing], None] = space["test_it"]
    target: Any = SimpleNamespace(name="lawn-g00-s00")
    flight = CompletedFlight(result=RESULT, sha256="", record=file)
    landing = Landing(target, flight, test)
    try:
        test(landing)
    except (AssertionError, AttributeError, TypeError, pytest.fail.Exception) as error:
        return failure_of("test_it", test, error, landing.reads)
    raise AssertionError("it passes")


def digest(tmp_path: Path, body: str, helpers: str = "") -> str:
    name = f"{len(list(tmp_path.iterdir()))}"
    (tmp_path / name).mkdir()
    found = failing(tmp_path / name, body, helpers)
    assert found is not None
    return found.assertion


@pytest.mark.parametrize(
    "body",
    [
        "assert not landing.collisions",
        "hit = landing.collisions\nassert not hit",
        "assert not hit(landing)",
        "assert (\n    landing.final_distance_m < 5\n    and not landing.collisions\n)",
        "assert landing.outcome == 'landed'",
        "if landing.collisions:\n    pytest.fail('hit')",
        "for name in landing.collisions:\n    assert not name",
    ],
)
def test_assertion_that_reads_collisions_is_about_them(tmp_path: Path, body: str) -> None:
    found = failing(tmp_path, body, "def hit(landing):\n    return landing.collisions\n")
    assert found is not None
    assert is_about(found.attributes, "collision")
    assert not is_about(found.attributes, None)


@pytest.mark.parametrize(
    "body",
    [
        "assert landing.final_distance_m < 1",
        "assert landing.collisions\nassert landing.elapsed_s < 1",
        "assert 1 > 2",
        "assert landing.elapsed_s < 1, f'{landing.collisions} and {landing.verdict}'",
    ],
)
def test_assertion_that_reads_something_else_is_not_about_collisions(
    tmp_path: Path, body: str
) -> None:
    found = failing(tmp_path, body)
    assert found is not None
    assert not is_about(found.attributes, "collision")


@pytest.mark.parametrize(
    "body", ["raise TypeError", "landing.colisions", "pytest.xfail('known')", "assert landing.x"]
)
def test_other_exceptions_are_no_failed_assertions(tmp_path: Path, body: str) -> None:
    assert failing(tmp_path, body) is None


def test_layout_comments_and_messages_do_not_change_a_statement(tmp_path: Path) -> None:
    plain = digest(tmp_path, "assert landing.elapsed_s < 1")
    for body in (
        "# why\nassert landing.elapsed_s   <  1, 'too late'",
        "assert (\n    landing.elapsed_s  # seconds\n    < 1\n)",
        "if True:\n    assert landing.elapsed_s < 1",
    ):
        assert digest(tmp_path, body) == plain
    assert digest(tmp_path, "assert landing.elapsed_s < 2") != plain


def test_calls_of_one_helper_are_different_statements(tmp_path: Path) -> None:
    helper = "def below(value, limit):\n    assert value < limit\n"
    late = digest(tmp_path, "below(landing.elapsed_s, 1)", helper)
    far = digest(tmp_path, "below(landing.final_distance_m, 1)", helper)
    assert late != far
    assert late == digest(tmp_path, "x = 1\nbelow(landing.elapsed_s, 1)", helper)
