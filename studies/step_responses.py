"""Step responses of the ArduPilot-style flight control.

``python -m studies.step_responses`` flies the steps, draws ``docs/pictures/step-responses.png`` and
prints the tables of ``docs/control.md``.  One table holds values computed from the gains: the poles
of the linear attitude loops and the overshoot of the shaped target.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from landing_systems.modules.control_ardupilot import (
    ArduPilotControl,
    ArduPilotParameters,
    RatePid,
    tuned,
    vehicle_of,
)
from pytest_garl import Airframe
from pytest_garl.flight.thresholds import BODY_ABOVE_FEET_M
from pytest_garl.simulation.physics.vehicle import (
    MOTOR_LAG_S,
    YAW_TORQUE_PER_THRUST_M,
    vehicle_model,
)
from tests.support.bare_flight import Trace, fly_bare

PICTURE = Path(__file__).parents[1] / "docs" / "pictures" / "step-responses.png"
SETTLED_S = 14.0
"""Time after which the take-off to 5 m no longer shows."""
HEIGHT_M = 5.0
HOVER = (0.0, 0.0, HEIGHT_M + BODY_ABOVE_FEET_M)
WIND_MPS = 5.0
Array = NDArray[np.float64]


def tuned_parameters() -> ArduPilotParameters:
    """Return the default parameters of the controller."""
    return tuned(vehicle_of(Airframe()).hover_throttle)


def give(order: str, control: ArduPilotControl) -> None:
    """Give the order that makes the step."""
    if order == "position":
        control.guide(position=(5.0, *HOVER[1:]))
    elif order == "climb":
        control.guide(position=(*HOVER[:2], HOVER[2] + 3.0))
    elif order == "yaw":
        control.guide(position=HOVER, yaw=math.pi / 2)
    elif order == "land":
        control.land()


def after_take_off(
    order: str, duration_s: float, parameters: ArduPilotParameters, wind: bool = False
) -> Trace:
    """Fly one step from a hover; the trace begins with the step."""
    start = HEIGHT_M * 2 if order == "land" else HEIGHT_M
    begin = SETTLED_S

    def orders(time_s: float, control: ArduPilotControl) -> None:
        if time_s == 0.5:
            control.take_off(start)
        if time_s == begin:
            give(order, control)

    trace = fly_bare(
        orders,
        begin + duration_s,
        parameters=parameters,
        wind_mps=(WIND_MPS, 0.0) if wind else (0.0, 0.0),
        wind_from_s=begin,
    )
    return trace.since(begin)


def figures(time_s: Array, value: Array, step: float) -> tuple[float, float, float, float]:
    """Return overshoot (share), rise time 10-90 %, settling time to 2 % and the final error."""
    part = (value - value[0]) / step
    rise = time_s[np.argmax(part > 0.9)] - time_s[np.argmax(part > 0.1)]
    outside = np.nonzero(np.abs(part - 1) > 0.02)[0]
    settled = time_s[outside[-1]] if len(outside) else 0.0
    return max(0.0, float(part.max()) - 1), float(rise), float(settled), float(part[-1] - 1) * step


def attitude_poles(pid: RatePid, angle_p: float, gain: float) -> NDArray[np.complex128]:
    """Return the poles of angle P around rate PID around a motor with lag.

    ``gain`` is the angular acceleration in rad/s² that the mixer's 1 gives.  States: angle,
    rate, motor, filtered target, filtered error, integral, filtered derivative.
    """
    off = 1e4  # rad/s: a filter that is off
    target, error, slope = (
        2 * math.pi * cut if cut else off for cut in (pid.fltt, pid.flte, pid.fltd)
    )
    a, unit = np.zeros((7, 7)), np.eye(7)
    a[0, 1], a[1, 2] = 1, gain
    a[3] = target * (-angle_p * unit[0] - unit[3])
    a[4] = error * (unit[3] - unit[1] - unit[4])
    a[5] = pid.i * unit[4]
    a[6] = slope * (a[4] - unit[6])
    a[2] = (pid.p * unit[4] + unit[5] + pid.d * unit[6] - unit[2]) / MOTOR_LAG_S
    poles: NDArray[np.complex128] = np.linalg.eigvals(a).astype(np.complex128)
    return poles


def implied(pid: RatePid, angle_p: float, gain: float) -> tuple[float, float]:
    """Return the damping of the least damped poles and the overshoot of such a pair."""
    poles = attitude_poles(pid, angle_p, gain)
    damping = min(float(-pole.real / abs(pole)) for pole in poles if pole.imag > 1e-6)
    return damping, math.exp(-math.pi * damping / math.sqrt(1 - damping**2))


def attitude_table() -> list[str]:
    """Return the table of damping and overshoot computed from the attitude gains."""
    model = vehicle_model(Airframe())
    lever = model.lever_m
    # The mixer's 1 moves each of the four motors by half of its range.
    roll = 2 * model.max_thrust_n * lever / model.inertia[0]
    yaw = 2 * model.max_thrust_n * YAW_TORQUE_PER_THRUST_M / model.inertia[2]
    lines = ["| loop | 1 gives | damping | overshoot implied |", "| --- | --- | --- | --- |"]
    default, chosen = ArduPilotParameters(), tuned_parameters()
    for name, pid, angle_p, gain in (
        ("roll and pitch, defaults", default.atc_rat_rll, default.atc_ang_rll_p, roll),
        ("yaw, defaults", default.atc_rat_yaw, default.atc_ang_yaw_p, yaw),
        ("yaw, tuned", chosen.atc_rat_yaw, chosen.atc_ang_yaw_p, yaw),
    ):
        damping, over = implied(pid, angle_p, gain)
        lines.append(f"| {name} | {gain:.1f} rad/s² | {damping:.2f} | {100 * over:.0f} % |")
    return lines


def step_table(traces: dict[str, Trace]) -> list[str]:
    """Return the table of the steps."""
    lines = [
        "| step | overshoot | of the shaped target | rise | settled | error at the end |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for name, axis, step in (("position", 0, 5.0), ("climb", 2, 3.0)):
        trace = traces[name]
        over, rise, settled, error = figures(trace.time_s, trace.position_m[:, axis], step)
        target = figures(trace.time_s, trace.target_m[:, axis], step)[0]
        lines.append(
            f"| {name}, {step:g} m | {100 * over:.1f} % | {100 * target:.1f} % | {rise:.2f} s "
            f"| {settled:.2f} s | {1000 * error:.0f} mm |"
        )
    for name in ("yaw", "yaw, defaults"):
        trace = traces[name]
        over, rise, settled, error = figures(trace.time_s, trace.yaw_rad, math.pi / 2)
        lines.append(
            f"| {name}, 90° | {100 * over:.1f} % | | {rise:.2f} s | {settled:.2f} s "
            f"| {math.degrees(error):.2f}° |"
        )
    return lines


def other_figures(traces: dict[str, Trace]) -> list[str]:
    """Return the table of the descent and of the wind."""
    land, wind = traces["land"], traces["wind"]
    grounded = int(np.argmax(land.position_m[:, 2] < BODY_ABOVE_FEET_M + 0.002))
    stopped = land.modes.index("stopped")
    drift = np.abs(land.position_m[:grounded, :2]).max()
    away = np.hypot(wind.position_m[:, 0], wind.position_m[:, 1])
    back = wind.time_s[np.nonzero(away > 0.1)[0][-1]]
    lean = math.degrees(float(np.arccos(1 - 2 * (wind.attitude[-1, :2] ** 2).sum())))
    return [
        "| | |",
        "| --- | --- |",
        f"| descent from 10 m | {land.time_s[grounded]:.1f} s |",
        f"| touchdown | {-land.velocity_mps[grounded - 2, 2]:.2f} m/s |",
        f"| motors off after touchdown | {land.time_s[stopped] - land.time_s[grounded]:.1f} s |",
        f"| sideways while descending | {1000 * drift:.0f} mm |",
        f"| wind of 5 m/s sets in: farthest off | {away.max():.2f} m |",
        f"| back within 0.1 m | {back:.1f} s |",
        f"| off at the end, lean | {1000 * away[-1]:.0f} mm, {lean:.1f}° |",
    ]


def draw(traces: dict[str, Trace], file: Path) -> None:
    """Draw the four pictures."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, 2, figsize=(10.5, 7.0), constrained_layout=True)
    for axis in axes.flat:
        axis.grid(color="0.9")
        axis.set_xlabel("time (s)")
    step = traces["position"]
    panel = axes[0, 0]
    panel.set_title("position: 5 m east")
    panel.plot(step.time_s, step.target_m[:, 0], "--", color="0.5", label="shaped target (m)")
    panel.plot(step.time_s, step.position_m[:, 0], label="position (m)")
    panel.plot(step.time_s, step.velocity_mps[:, 0], label="velocity (m/s)")
    panel.axhline(5.0, color="k", linewidth=0.6)
    panel.legend(loc="center right")
    panel = axes[0, 1]
    panel.set_title("heading: 90°")
    for name, label in (("yaw", "tuned"), ("yaw, defaults", "ArduPilot's default yaw gains")):
        trace = traces[name]
        panel.plot(trace.time_s, np.degrees(trace.yaw_rad), label=label)
    panel.axhline(90.0, color="k", linewidth=0.6)
    panel.set_ylabel("heading (°)")
    panel.legend(loc="lower right")
    panel = axes[1, 0]
    panel.set_title("LAND from 10 m")
    land = traces["land"]
    height = land.position_m[:, 2] - BODY_ABOVE_FEET_M
    panel.plot(land.time_s, height, label="height (m)")
    panel.plot(land.time_s, land.velocity_mps[:, 2], label="climb rate (m/s)")
    panel.plot(land.time_s, land.thrusts_n.sum(axis=1) / 10, label="thrust (10 N)")
    panel.axvline(
        land.time_s[land.modes.index("stopped")], color="k", linestyle=":", label="motors off"
    )
    panel.legend(loc="upper right")
    panel = axes[1, 1]
    panel.set_title("a wind of 5 m/s towards the east sets in")
    wind = traces["wind"]
    panel.plot(wind.time_s, wind.position_m[:, 0], label="off to the east (m)")
    panel.plot(wind.time_s, wind.velocity_mps[:, 0], label="velocity (m/s)")
    panel.axhline(0.0, color="k", linewidth=0.6)
    panel.legend(loc="upper right")
    figure.savefig(file, dpi=90)
    pyplot.close(figure)


def main() -> None:
    """Fly all steps, draw them and print the tables."""
    chosen, default = tuned_parameters(), ArduPilotParameters()
    # The default's hover throttle is wrong by a quarter: here only the gains are compared.
    gains = replace(default, mot_thst_hover=chosen.mot_thst_hover)
    traces = {
        "position": after_take_off("position", 12.0, chosen),
        "climb": after_take_off("climb", 12.0, chosen),
        "yaw": after_take_off("yaw", 8.0, chosen),
        "yaw, defaults": after_take_off("yaw", 8.0, gains),
        "land": after_take_off("land", 26.0, chosen),
        "wind": after_take_off("hold", 20.0, chosen, wind=True),
    }
    draw(traces, PICTURE)
    for table in (attitude_table(), step_table(traces), other_figures(traces)):
        print("\n".join(table), end="\n\n")


if __name__ == "__main__":
    main()
