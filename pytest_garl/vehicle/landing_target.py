"""Position of the landing target: ArduPilot's precision landing estimator, in the world frame.

ArduPilot measures the target relative to the vehicle and moves the estimate with its inertial
sensors.  Here a measurement is a place in the world, made with the vehicle's pose at the time
of the image, so ``PLND_LAG``, ``PLND_CAM_POS_*`` and ``PLND_YAW_ALIGN`` have nothing to do.
"""

from __future__ import annotations

from pytest_garl.vehicle.parameters import ArduPilotParameters
from pytest_garl.vehicle.shaping import Pair

INITIAL_S = 2.0
INITIAL_GAP_S = 0.5
"""A target counts once it was measured for 2 s without a gap of more than 0.5 s."""
LOST_AFTER_S = 2.0
NIS_GATE = 3.0
MAX_REJECTED = 3
"""A measurement is refused if its squared innovation exceeds 3 variances on either axis; after
three refusals in a row the next is believed."""
INITIAL_VELOCITY_VARIANCE = 4.0
"""(2 m/s)²: engineering choice, well above the speed of a target that stands."""
ARDUPILOT_RATE_HZ = 400.0
"""ArduPilot adds (PLND_ACC_P_NSE / 400 Hz)² to the velocity's variance at each of its steps."""


class AxisFilter:
    """A Kalman filter with position (m) and velocity (m/s), driven by white acceleration.

    Variances are in m².
    """

    def __init__(self, acceleration_noise_mps2: float, position: float, variance: float) -> None:
        self._density = acceleration_noise_mps2**2 / ARDUPILOT_RATE_HZ
        self.position, self.velocity = position, 0.0
        self._p00, self._p01, self._p11 = variance, 0.0, INITIAL_VELOCITY_VARIANCE

    @property
    def variance(self) -> float:
        """Variance of the position in m²."""
        return self._p00

    def predict(self, dt_s: float) -> None:
        """Advance by a time: x' = F x, P' = F P F^T + Q of a double integrator."""
        q = self._density
        self.position += self.velocity * dt_s
        self._p00 += dt_s * (2 * self._p01 + dt_s * self._p11) + q * dt_s**3 / 3
        self._p01 += dt_s * self._p11 + q * dt_s**2 / 2
        self._p11 += q * dt_s

    def nis(self, measured: float, variance: float) -> float:
        """Return the normalised innovation squared of a measurement."""
        return (measured - self.position) ** 2 / (self._p00 + variance)

    def fuse(self, measured: float, variance: float) -> None:
        """Take a measurement of the position in."""
        total = self._p00 + variance
        k0, k1 = self._p00 / total, self._p01 / total
        innovation = measured - self.position
        self.position += k0 * innovation
        self.velocity += k1 * innovation
        self._p11 -= k1 * self._p01
        self._p01 *= 1 - k0
        self._p00 *= 1 - k0


def measurement_variance(height_m: float, rate_radps: float) -> float:
    """Return the variance in m²: the angle's noise grows with the body's rate, plus 2 cm."""
    return (height_m * (0.01 + 0.01 * rate_radps) + 0.02) ** 2


class LandingTarget:
    """The estimate of the target; ``PLND_EST_TYPE`` 0 believes each measurement as it is."""

    def __init__(self, parameters: ArduPilotParameters) -> None:
        self._p = parameters
        self.reset()

    def reset(self) -> None:
        """Forget the target."""
        self._x: AxisFilter | None = None
        self._y: AxisFilter | None = None
        self._rejected = 0
        self._began_s = 0.0
        self._acquired = False
        self._filtered_s = 0.0
        self.measured_s: float | None = None
        """Time of the last accepted measurement."""

    def measure(self, place: Pair, time_s: float, height_m: float, rate_radps: float) -> bool:
        """Take a measurement (x, y) in the world; return whether it was believed.

        ``height_m`` is the vehicle's height above the target and ``rate_radps`` its turning
        rate, both at ``time_s``; one that is older than the last is refused.
        """
        if self.measured_s is not None and time_s <= self._filtered_s:
            return False
        variance = measurement_variance(max(0.0, height_m), rate_radps)
        gap = INITIAL_GAP_S if not self._acquired else LOST_AFTER_S
        x, y = self._x, self._y
        if x is None or y is None or self.measured_s is None or time_s - self.measured_s > gap:
            self._begin(place, time_s, variance)
            return True
        x.predict(time_s - self._filtered_s)
        y.predict(time_s - self._filtered_s)
        self._filtered_s = time_s
        if self._p.plnd_est_type == 0:
            x.position, y.position, x.velocity, y.velocity = place[0], place[1], 0.0, 0.0
        elif (
            max(x.nis(place[0], variance), y.nis(place[1], variance)) < NIS_GATE
            or self._rejected >= MAX_REJECTED
        ):
            x.fuse(place[0], variance)
            y.fuse(place[1], variance)
            self._rejected = 0
        else:
            self._rejected += 1
            return False
        self.measured_s = time_s
        self._acquired = self._acquired or time_s - self._began_s >= INITIAL_S
        return True

    def found(self, time_s: float) -> bool:
        """Return whether the target is in sight, as far as precision landing cares."""
        if self.measured_s is None or time_s - self.measured_s > LOST_AFTER_S:
            self._acquired = False
        return self._acquired

    def place(self, time_s: float) -> Pair:
        """Return the estimate (x, y) in m, at a time not before the last measurement.

        Raises ValueError if no target was measured; ask ``found`` first.
        """
        if self._x is None or self._y is None or self.measured_s is None:
            raise ValueError("no landing target was measured yet; ask found() first")
        ahead = max(0.0, time_s - self._filtered_s)
        return (
            self._x.position + ahead * self._x.velocity,
            self._y.position + ahead * self._y.velocity,
        )

    def _begin(self, place: Pair, time_s: float, variance: float) -> None:
        noise = self._p.plnd_acc_p_nse
        self._x = AxisFilter(noise, place[0], variance)
        self._y = AxisFilter(noise, place[1], variance)
        self._rejected, self._began_s = 0, time_s
        self._filtered_s = self.measured_s = time_s
        self._acquired = self._p.plnd_est_type == 0
