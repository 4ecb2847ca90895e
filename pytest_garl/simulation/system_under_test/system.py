"""The landing system of one flight: creates it and calls its methods."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pytest_garl.landing_system import (
    Abort,
    Airframe,
    Command,
    Mission,
    Observation,
    VehicleState,
)
from pytest_garl.simulation.physics.vehicle import Thrusts
from pytest_garl.simulation.system_under_test.calls import (
    StepGuard,
    SystemCalls,
    SystemFailedError,
    read_airframe,
)
from pytest_garl.simulation.system_under_test.diagnostics import DiagnosticsQuota
from pytest_garl.simulation.system_under_test.ground_truth import (
    TruthPilot,
    is_own,
    truth_pilot_of,
)
from pytest_garl.simulation.system_under_test.validation import read_command, read_thrusts


class SystemUnderTest:
    """The landing system of one flight.

    Every call may raise SystemFailedError, which ends the flight.
    ``needs_camera`` and ``truth_pilot``, a pilot of this package that gets ground truth, are known
    after ``start``.  ``has_stepped`` is whether ``step`` has returned a command, ``gave_up``
    whether the last one was ``Abort()``.
    """

    def __init__(self, make_system: Callable[[], Any], guard: StepGuard | None) -> None:
        self._make_system = make_system
        self._calls = SystemCalls(make_system, guard)
        self._quota = DiagnosticsQuota()
        self.airframe, self._airframe_error = self._read_airframe()
        self.needs_camera = True
        self.truth_pilot: TruthPilot | None = None
        self.has_stepped = self.gave_up = False
        self._system: Any = None

    def _read_airframe(self) -> tuple[Airframe, SystemFailedError | None]:
        """Return the airframe; on failure the default and the error, which ``start`` raises."""
        try:
            return self._calls.run("airframe", lambda: read_airframe(self._make_system)), None
        except SystemFailedError as error:
            return Airframe(), error

    def start(self, mission: Mission) -> None:
        """Create the system and reset it."""
        if self._airframe_error:
            raise self._airframe_error
        self._system = self._calls.run("reset", lambda: self._make_system())
        self._calls.run("reset", lambda: self._system.reset(mission))
        self.needs_camera = self._calls.run(
            "needs_camera", lambda: bool(getattr(self._system, "needs_camera", True))
        )
        self.truth_pilot = truth_pilot_of(self._system)

    @property
    def returns_since_s(self) -> float | None:
        """Since when a vehicle of this package returns home; None if it does not, or is another."""
        if not is_own(type(self._system)):
            return None
        since_s: float | None = getattr(self._system, "returns_since_s", None)
        return since_s

    def step(self, observation: Observation) -> Command:
        """Return the checked command for one camera frame."""
        command: Command = self._calls.run(
            "step", lambda: read_command(self._system.step(observation), self._quota)
        )
        self.has_stepped = True
        self.gave_up = isinstance(command, Abort)
        return command

    def control(self, state: VehicleState, max_thrust_n: float) -> Thrusts:
        """Return the checked thrusts of a system that has its own flight control, in newtons."""
        thrusts: Thrusts = self._calls.run(
            "control", lambda: read_thrusts(self._system.control(state), max_thrust_n)
        )
        return thrusts

    def close(self) -> None:
        """Close a system that was created and has ``close``."""
        if self._system is not None:
            self._calls.run("close", lambda: getattr(self._system, "close", lambda: None)())

    def not_finite_error(self, time_s: float) -> SystemFailedError:
        """Return the error for a flight whose state has become NaN or infinite."""
        return self._calls.nonsense_error(
            "NotFinite",
            f"after {time_s:.2f} s the flight is no longer one of finite numbers; expected "
            "commands and an airframe that the physics can follow",
            "step",
        )
