"""A landing system may raise anything: it becomes a record of bounded size."""

from __future__ import annotations

import dataclasses
import json
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pytest_garl import (
    Airframe,
    Land,
)
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import Limits
from tests.support.answers import flight_of, flight_with
from tests.support.flights import Scripted


class BadText(Exception):  # noqa: N818 (as users name theirs)
    def __str__(self) -> str:
        raise RuntimeError("no text")


class BadNotes(Exception):  # noqa: N818
    __notes__ = property(lambda self: 1 / 0)


class Leaves(BaseException):
    pass


LongName = type("L" * 400 + "/..", (Exception,), {})


@pytest.mark.parametrize(
    ("error", "name", "words"),
    [
        (BadText(), "BadText", "whose str() raised RuntimeError"),
        (BadNotes("notes"), "BadNotes", "notes"),
        (ValueError("x" * 50_000_000), "ValueError", "... (cut, 50000000 characters)"),
        (LongName("long"), "L" * 80, "long"),
        (SystemExit(3), "SystemExit", "3"),
        (Leaves("without a word"), "Leaves", "without a word"),
        (ValueError(f"no plan for {object()}"), "ValueError", "object at 0x...>"),
        (ValueError("\ud800 \x1b[2J"), "ValueError", "\\ud800"),
        (ExceptionGroup("many", [ValueError("a")] * 3), "ExceptionGroup", "many"),
    ],
    ids=lambda value: value[:20] if isinstance(value, str) else "",
)
def test_every_exception_becomes_a_record_of_bounded_size(
    error: BaseException, name: str, words: str, tmp_path: Path
) -> None:
    def answer() -> Any:
        raise error

    crash = flight_with(answer).crash
    assert crash.kind == "raised"
    assert crash.error == name
    assert words in crash.message
    assert "in answer" in crash.traceback or name == "BadNotes"
    assert len(json.dumps(dataclasses.asdict(crash))) < 60_000
    assert len(judge(flight_with(answer), Limits()).story) < 700
    (tmp_path / f"case-{crash.error}.toml").write_text(crash.message, encoding="utf-8")


def test_endless_recursion_is_a_finding() -> None:
    def answer() -> Any:
        return answer()

    crash = flight_with(answer).crash
    assert crash.error == "RecursionError"
    assert len(crash.traceback) < 30_000


def test_ctrl_c_of_the_user_passes() -> None:
    def answer() -> Any:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        flight_with(answer)


def test_sigterm_during_a_call_passes() -> None:
    from pytest_garl.cli import _exit

    before = signal.getsignal(signal.SIGTERM)
    try:
        with pytest.raises(SystemExit, match="143"):
            flight_with(lambda: _exit(signal.SIGTERM, None))
    finally:
        signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize("name", ["needs_camera", "control", "step"])
def test_property_that_raises_is_a_finding(name: str) -> None:
    def fail(self: object) -> Any:
        raise RuntimeError(f"no {name}")

    space = {name: property(fail), "airframe": Airframe(control_rate_hz=240)}
    flight = flight_of(type("Fails", (Scripted,), {"step": lambda self, _: Land()} | space))
    assert flight.crash.error == "RuntimeError"
    assert flight.crash.message == f"no {name}"


def test_truth_value_that_raises_is_a_finding() -> None:
    class Unsure:
        def __bool__(self) -> bool:
            raise RuntimeError("neither")

    system = type("Fails", (Scripted,), {"step": lambda *_: Land(), "needs_camera": Unsure()})
    assert flight_of(system).crash.message == "neither"


@pytest.fixture(autouse=True)
def _no_numpy_warnings() -> Iterator[None]:
    with np.errstate(all="raise"):
        yield
