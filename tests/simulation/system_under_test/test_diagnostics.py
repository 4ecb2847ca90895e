"""Diagnostics are recorded within bounds."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from pytest_garl import (
    Detection,
    Land,
)
from pytest_garl.simulation.system_under_test import diagnostics
from pytest_garl.simulation.system_under_test.diagnostics import DiagnosticsQuota
from pytest_garl.simulation.system_under_test.reading import NonsenseError
from pytest_garl.simulation.system_under_test.validation import read_command
from tests.support.answers import land_with


def test_a_long_text_is_cut_and_says_so() -> None:
    command = read_command(land_with(phase="p" * 200, note="n" * 2_000), DiagnosticsQuota())
    assert command.diagnostics
    assert command.diagnostics.phase == "p" * 100 + "... (cut, 200 characters)"
    assert command.diagnostics.note.endswith("n... (cut, 2000 characters)")


def test_a_long_path_keeps_its_ends_and_points_between_them() -> None:
    for count in (0, 1, 99, 100, 101, 199, 1_000):
        path = tuple((float(index), 0.0, 0.0) for index in range(count))
        command = read_command(land_with(planned_path_m=path), DiagnosticsQuota())
        assert command.diagnostics
        kept = command.diagnostics.planned_path_m
        assert len(kept) <= 100
        assert (kept[:1], kept[-1:]) == (path[:1], path[-1:])
        assert kept == path or len(kept) >= 50


def test_a_system_may_say_that_there_are_no_obstacles() -> None:
    for obstacles, kept in ((None, None), ((), ()), (((1, 2, 3),), ((1.0, 2.0, 3.0),))):
        command = read_command(land_with(obstacles_m=obstacles), DiagnosticsQuota())
        assert command.diagnostics
        assert command.diagnostics.obstacles_m == kept


def rich_landing(detections: int, characters: int = 1_000) -> Land:
    corners = ((0.1234567890123, -1e-17),) * 32
    seen = Detection(
        marker_id=0, confidence=0.5, position_m=(0.1, -0.2e-99, 0.3), corners_px=corners
    )
    path = ((0.1234567890123456, 1.0, 2.0),) * 100
    return land_with(
        detections=(seen,) * detections, planned_path_m=path, note="\U0001f6ec" * characters
    )


def fill(quota: DiagnosticsQuota, steps: list[dict[str, Any]]) -> None:
    while True:
        command = read_command(rich_landing(100), quota)
        assert command.diagnostics
        steps.append(dataclasses.asdict(command.diagnostics))


def test_flood_of_diagnostics_is_recorded_in_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(diagnostics, "MAX_DIAGNOSTICS_BYTES", 2_400_000)
    steps: list[dict[str, Any]] = []
    with pytest.raises(NonsenseError, match="fill more than 2400000 bytes") as refused:
        fill(DiagnosticsQuota(), steps)
    assert refused.value.error == "BadDiagnostics"
    assert steps[0]["note"]
    assert not steps[-1]["note"]
    assert len(steps[-1]["detections"]) == 100
    assert len(json.dumps(steps)) < 2_400_000


def test_the_recorder_keeps_all_that_verdicts_need_at_the_highest_rate(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A tenth of the longest flight at 240 Hz in a tenth of the quota."""
    monkeypatch.setattr(
        diagnostics, "MAX_DIAGNOSTICS_BYTES", diagnostics.MAX_DIAGNOSTICS_BYTES // 10
    )
    quota = DiagnosticsQuota()
    for _ in range(12 * 240):
        command = read_command(rich_landing(2, characters=60), quota)
    assert command.diagnostics
    assert len(command.diagnostics.detections) == 2


@pytest.fixture(autouse=True)
def _no_numpy_warnings() -> Iterator[None]:
    with np.errstate(all="raise"):
        yield
