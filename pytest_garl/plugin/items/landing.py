"""One flown landing, as a test sees it: the fixture ``landing``."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable
from types import FrameType
from typing import TYPE_CHECKING, Any, TypeVar

import pytest

from pytest_garl.plugin.items import outcomes
from pytest_garl.plugin.items.failed_statement import AttributeRead, code_of

if TYPE_CHECKING:
    from pytest_garl.execution.flight_id import CompletedFlight
    from pytest_garl.execution.result import FlightResult
    from pytest_garl.flight.flight import Flight
    from pytest_garl.plugin.items.target import Target
    from pytest_garl.verdicts.verdict import Limits, Verdict

T = TypeVar("T")


class Landing:
    """One flown landing, as a test sees it.

    Reading a property that the flight did not decide skips the test with the reason, as
    ``outcomes.py`` decides; ``final_distance_m`` and ``elapsed_s`` can always be read.  ``reads``
    is what ``test`` has read so far, to distinguish a failure from another property's.
    ``is_shown_elsewhere`` says whether another test of the slot fails for the flight's violation.
    """

    def __init__(
        self,
        target: Target,
        flight: CompletedFlight,
        test: Callable[..., Any] | None = None,
        *,
        is_shown_elsewhere: Callable[[], bool] = lambda: False,
    ) -> None:
        self._target, self._result, self._record = target, flight.result, flight.record
        self._code = code_of(test) if test else None
        self._is_shown_elsewhere = is_shown_elsewhere
        self.slot: str = target.name
        self.reads: list[AttributeRead] = []
        self.left_to_another_test = False

    @property
    def result(self) -> FlightResult:
        """The flight's result as it stands in the ledger."""
        self._note("result")
        return self._result

    @property
    def unnoted_result(self) -> FlightResult:
        """The same result for the plugin: its reads are no reads of the test."""
        return self._result

    @property
    def outcome(self) -> str:
        """How the flight ended: landed, collision, slid, gave_up, not_landed, held or crashed."""
        self._note("outcome")
        return self._result.outcome

    @property
    def final_distance_m(self) -> float:
        """Horizontal distance from the marker's centre where the flight ended, however it did."""
        self._note("final_distance_m")
        return self._result.final_distance_m

    @property
    def elapsed_s(self) -> float:
        """Time from the mission's start to the flight's end, however it ended."""
        self._note("elapsed_s")
        return self._result.elapsed_s

    def __repr__(self) -> str:
        # pytest writes it several times into one failure, whose own section says what happened.
        return f"<Landing {self.slot}>"

    @property
    def limits(self) -> Limits:
        """The limits of the marker."""
        return self._target.limits

    @property
    def completed(self) -> bool:
        """Whether the mission was completed: landed within the limit of distance.

        A UAV that holds its place completes it by a target on the marker, and without a violation.
        If another test of the slot fails for the same violation, this one is skipped: one event
        fails one test.
        """
        self._note("completed")
        return self._judged(outcomes.completed(self._result))

    @property
    def excused(self) -> str:
        """Why nobody could have landed; empty if somebody could, or if the UAV landed."""
        self._note("excused")
        return outcomes.excuse_of(self._result)

    @property
    def distance_to_landing_m(self) -> float:
        """Horizontal distance from the UAV to the marker's centre where it landed.

        Infinite if it slid on after its touchdown.  If it touched the ground too far off before,
        that place counts.  Of a UAV that holds its place: the largest distance beyond which the
        system's target stayed for half a second.
        """
        self._note("distance_to_landing_m")
        return self._judged(outcomes.distance_to_landing(self._result))

    @property
    def time_to_landing_s(self) -> float:
        """Time from the mission's start to the touchdown.

        Infinite if the UAV never landed although somebody could have.  Of a UAV that holds its
        place: the time to the first plan for the marker; infinite if the marker was not reported or
        the planner ended.
        """
        self._note("time_to_landing_s")
        return self._judged(outcomes.time_to_landing(self._result, self.limits))

    @property
    def collisions(self) -> tuple[str, ...]:
        """Names of the bodies that the UAV hit; "ground" for a hard touchdown.

        Of a UAV that holds its place: of the bodies through which its plans led for half a second.
        """
        self._note("collisions")
        return self._judged(outcomes.collisions(self._result))

    @property
    def verdict(self) -> Verdict:
        """The built-in judgement."""
        self._note("verdict")
        return self._result.verdict

    @functools.cached_property
    def flight(self) -> Flight:
        """The flight's whole record, loaded from its file."""
        from pytest_garl.flight.flight_file import load

        return load(self._record)

    def _judged(self, found: outcomes.PropertyRead[T]) -> T:
        """Return a property's value, or skip the test as is decided for it."""
        if found.undecided is not None:
            pytest.skip(f"{outcomes.NOT_JUDGED}: {found.undecided}")
        if found.belongs_elsewhere and self._is_shown_elsewhere():
            self.left_to_another_test = True
            why = f"another test of this flight fails for {self._result.signature}"
            pytest.skip(f"{outcomes.NOT_JUDGED}: {why}")
        return found.value

    def _note(self, name: str) -> None:
        """Remember what the test reads, and in which line of its own body."""
        frame: FrameType | None = sys._getframe(2)
        while frame is not None and frame.f_code is not self._code:
            frame = frame.f_back
        self.reads.append(AttributeRead(name=name, line=frame.f_lineno if frame else 0))
