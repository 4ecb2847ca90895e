"""The error of the UAV's own estimate of its state, and a jump of the estimated position."""

from __future__ import annotations

from pytest_garl.scenarios.groups.parameter import Group, Parameter

_ANY = "any direction"
NAVIGATION = Group(
    name="navigation",
    meaning="error of the estimated state, which wanders slowly",
    parameters=(
        Parameter(
            name="position_m",
            nominal=0.0,
            low=0.0,
            high=10.0,
            meaning="horizontal error of the estimated position: at the start, and its root mean "
            "square",
            source="u-blox M8 data sheet: 2.5 m CEP with GPS and GLONASS",
        ),
        Parameter(
            name="towards_deg",
            nominal=0.0,
            low=0.0,
            high=360.0,
            even=True,
            meaning="direction of that error at the start (0: east, 90: north)",
            source=_ANY,
        ),
        Parameter(
            name="height_m",
            nominal=0.0,
            low=0.0,
            high=5.0,
            meaning="root mean square of the error of the estimated height; none at the start",
            source="MS5611 data sheet: 10 cm resolution; Sabatini and Genovese 2014: barometers "
            "drift by decimetres in minutes",
        ),
        Parameter(
            name="yaw_deg",
            nominal=0.0,
            low=-45.0,
            high=45.0,
            meaning="error of the estimated heading: at the start, and its root mean square",
            source="PX4, COM_ARM_EKF_YAW: arms up to 0.5 rad; a compass near motors errs by some "
            "degrees",
        ),
        Parameter(
            name="tilt_deg",
            nominal=0.0,
            low=0.0,
            high=10.0,
            meaning="error of the estimated roll and pitch: at the start, and its root mean square",
            source="Matrice 100 user manual: hovering accuracy needs a calibrated IMU; "
            "Xsens MTi-3 data sheet: 0.8 to 1 degree RMS, twice that after a hard landing",
        ),
        Parameter(
            name="tilt_towards_deg",
            nominal=0.0,
            low=0.0,
            high=360.0,
            even=True,
            meaning="direction in which the tilt errs at the start (0: nose down, 90: right down)",
            source=_ANY,
        ),
        Parameter(
            name="correlation_s",
            nominal=300.0,
            low=30.0,
            high=600.0,
            even=True,
            meaning="correlation time of the errors",
            source="Rankin 1994: GPS errors as Gauss-Markov processes of minutes",
        ),
    ),
)
JUMP = Group(
    name="jump",
    meaning="a jump of the estimated position",
    parameters=(
        Parameter(
            name="from_s",
            nominal=0.0,
            low=0.0,
            high=300.0,
            even=True,
            meaning="when it jumps, after the start of the flight",
            source="a landing takes some 10 to 40 s",
        ),
        Parameter(
            name="distance_m",
            nominal=0.0,
            low=0.0,
            high=20.0,
            meaning="how far it jumps; it stays there",
            source="ArduPilot, EK3_GLITCH_RAD: the filter resets its position when GPS is 25 m "
            "away; multipath moves GPS by metres",
        ),
        Parameter(
            name="towards_deg",
            nominal=0.0,
            low=0.0,
            high=360.0,
            even=True,
            meaning="direction of the jump (0: east, 90: north)",
            source=_ANY,
        ),
    ),
)
GROUPS = (NAVIGATION, JUMP)
