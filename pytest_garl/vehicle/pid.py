"""The PID of the rate and acceleration loops, with filters, IMAX and anti-windup."""

from __future__ import annotations

from pytest_garl.vehicle.filters import smoothing


class Pid:
    """Proportional, integral and derivative of a filtered error; plain floats.

    Filters as in ArduPilot: the target, the error and the derivative of the filtered error
    each have a first-order low-pass with a cut-off in Hz; 0 is off.  The integral stays within
    ``imax`` and, while the output is limited, may only shrink.
    """

    def __init__(
        self,
        p: float,
        i: float,
        d: float,
        imax: float,
        *,
        fltt: float = 0.0,
        flte: float = 0.0,
        fltd: float = 0.0,
        dt_s: float,
    ) -> None:
        self._p, self._i, self._d, self._imax, self._dt = p, i, d, imax, dt_s
        self._of_target = smoothing(fltt, dt_s)
        self._of_error = smoothing(flte, dt_s)
        self._of_derivative = smoothing(fltd, dt_s)
        self.reset()

    def reset(self, integral: float = 0.0) -> None:
        """Forget the past; the next error is taken unfiltered."""
        self.integral = integral
        self._first = True
        self._target = self._error = self._derivative = 0.0

    def update(self, target: float, measured: float, limited: bool) -> float:
        """Return the output for one step; ``limited`` says that the last one was cut."""
        if self._first:
            self._first = False
            self._target, self._error, self._derivative = target, target - measured, 0.0
        else:
            self._target += self._of_target * (target - self._target)
            before = self._error
            self._error += self._of_error * (self._target - measured - before)
            slope = (self._error - before) / self._dt
            self._derivative += self._of_derivative * (slope - self._derivative)
        error = self._error
        if not limited or self.integral * error < 0:
            total, most = self.integral + self._i * error * self._dt, self._imax
            self.integral = most if total > most else -most if total < -most else total
        return self._p * error + self.integral + self._d * self._derivative
