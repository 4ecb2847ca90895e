from __future__ import annotations

from pathlib import Path

import pytest

from tests.misbehaving.suite import fly_suite, left_running, systems

pytestmark = pytest.mark.long


def test_there_are_more_than_a_hundred() -> None:
    assert len({system.__name__ for system in systems()}) == len(systems()) > 100


def test_no_misbehaving_system_ends_or_bends_a_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each is a finding or lands, the run goes on, and its neighbour flies the same bytes."""
    rows = fly_suite(systems(), tmp_path)
    findings = sum(row.came_to.startswith("V:") for row in rows)
    with capsys.disabled():
        print(f"\n{len(rows)} misbehaving systems: {findings} findings")  # noqa: T201
    assert [(row.name, row.came_to, row.problem) for row in rows if row.problem] == []
    assert not left_running()
