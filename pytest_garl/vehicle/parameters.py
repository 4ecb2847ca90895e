"""ArduPilot Copter's parameters that this controller reads, with ArduPilot's defaults.

A field's name is the ArduPilot name in lower case.  Values are in metres, seconds and radians;
where ArduPilot stores centimetres or centidegrees its own number stands beside.  Names and
defaults are those of the parameter list of Copter 4.3 to 4.6
(https://ardupilot.org/copter/docs/parameters.html); 4.7 renames some of them (``PSC_POSXY_P``
becomes ``PSC_NE_POS_P``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True, kw_only=True)
class RatePid:
    """The parameters of one axis of the rate controller, ``ATC_RAT_RLL_*`` and so on.

    Gains turn rad/s into the mixer's [-1, 1]; filters are cut-off frequencies in Hz, 0 is off:
    ``fltt`` of the target, ``flte`` of the error, ``fltd`` of the derivative.
    """

    p: float
    i: float
    d: float
    imax: float = 0.5
    fltt: float = 20.0
    flte: float = 0.0
    fltd: float = 20.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ArduPilotParameters:
    """Parameters that an operator of ArduPilot can set; the defaults are ArduPilot's.

    Raises ValueError for a mode of precision landing that ArduPilot does not have.
    """

    psc_posxy_p: float = 1.0
    """1/s."""
    psc_velxy_p: float = 2.0
    psc_velxy_i: float = 1.0
    psc_velxy_d: float = 0.5
    """m/s to m/s²."""
    psc_velxy_imax: float = 10.0
    """m/s²; 1000 cm/s²."""
    psc_velxy_flte: float = 5.0
    psc_velxy_fltd: float = 5.0
    """Hz."""
    psc_jerk_xy: float = 5.0
    psc_jerk_z: float = 5.0
    """m/s³."""
    psc_posz_p: float = 1.0
    """1/s."""
    psc_velz_p: float = 5.0
    psc_velz_flte: float = 5.0
    """m/s to m/s²; Hz."""
    psc_accz_p: float = 0.5
    psc_accz_i: float = 1.0
    psc_accz_d: float = 0.0
    """10 m/s² to the whole throttle: ArduPilot's unit is cm/s² to a thousandth."""
    psc_accz_imax: float = 0.8
    """Share of the throttle; 800 thousandths."""
    psc_accz_flte: float = 20.0
    psc_accz_fltd: float = 20.0
    """Hz."""

    wpnav_speed: float = 10.0
    wpnav_speed_up: float = 2.5
    wpnav_speed_dn: float = 1.5
    """m/s; 1000, 250 and 150 cm/s."""
    wpnav_accel: float = 2.5
    wpnav_accel_z: float = 1.0
    """m/s²; 250 and 100 cm/s²."""
    guid_timeout: float = 3.0
    """s: a velocity that is not renewed for this time is taken back."""

    angle_max: float = math.radians(30)
    """3000 centidegrees."""
    atc_ang_rll_p: float = 4.5
    atc_ang_pit_p: float = 4.5
    atc_ang_yaw_p: float = 4.5
    """1/s."""
    atc_accel_r_max: float = math.radians(1100)
    atc_accel_p_max: float = math.radians(1100)
    atc_accel_y_max: float = math.radians(270)
    """rad/s²; 110000 and 27000 centidegrees/s²."""
    atc_slew_yaw: float = math.radians(60)
    """rad/s; 6000 centidegrees/s."""
    atc_input_tc: float = 0.15
    """s."""
    atc_rate_ff_enab: bool = True
    atc_angle_boost: bool = True
    atc_rat_rll: RatePid = RatePid(p=0.135, i=0.135, d=0.0036)
    atc_rat_pit: RatePid = RatePid(p=0.135, i=0.135, d=0.0036)
    atc_rat_yaw: RatePid = RatePid(p=0.18, i=0.018, d=0.0, flte=2.5, fltd=0.0)
    atc_thr_mix_min: float = 0.1
    atc_thr_mix_max: float = 0.5
    """Weight of the hover throttle in the level about which attitude may push the motors."""

    mot_thst_hover: float = 0.35
    """Throttle that carries the vehicle, 0 to 1."""
    mot_yaw_headroom: float = 0.2
    """200 of the 1000 steps of a motor's output that yaw may always have."""
    mot_spool_time: float = 0.5
    """s."""
    tkoff_slew_time: float = 2.0
    """s: from no throttle to all of it, until the vehicle leaves the ground."""

    land_speed: float = 0.5
    land_speed_high: float = 0.0
    """m/s; 50 cm/s, and 0, which stands for ``WPNAV_SPEED_DN``."""
    land_alt_low: float = 10.0
    """m; 1000 cm."""

    plnd_enabled: bool = False
    plnd_est_type: int = 1
    """0 raw sensor, 1 Kalman filter."""
    plnd_acc_p_nse: float = 2.5
    """m/s²."""
    plnd_xy_dist_max: float = 2.5
    plnd_strict: int = 1
    """0 land anyway, 1 retry, then land, 2 retry, then hover."""
    plnd_ret_max: int = 4
    plnd_timeout: float = 4.0
    plnd_ret_behave: int = 0
    """0 climb to where the vehicle last saw the target from, 1 to above the target."""
    plnd_alt_min: float = 0.75
    plnd_alt_max: float = 8.0
    """m above the ground; 0 switches the limit off."""

    def __post_init__(self) -> None:
        if self.plnd_strict not in (0, 1, 2):
            raise ValueError(f"plnd_strict: found {self.plnd_strict}, expected 0, 1 or 2")
        if self.plnd_est_type not in (0, 1) or self.plnd_ret_behave not in (0, 1):
            raise ValueError(
                f"plnd_est_type, plnd_ret_behave: found {self.plnd_est_type}, "
                f"{self.plnd_ret_behave}, expected 0 or 1"
            )


def tuned(hover_throttle: float, base: ArduPilotParameters | None = None) -> ArduPilotParameters:
    """Return the parameters that an operator changes on this vehicle, the rest as in ``base``.

    ``MOT_THST_HOVER`` is what ArduPilot learns in a hover.  The yaw gains' defaults are too low
    for a vehicle that only the drag of its propellers turns: a turn of 90 degrees overshoots by
    44 and rings.  ``ATC_RAT_YAW_P`` is raised tenfold, which makes the yaw rate loop half as
    fast as roll's, with ``_I`` a tenth of it (AutoTune's ratio); ``_D``, ``_FLTD`` and ``_FLTE``
    are set, within their documented ranges, to damp it (gyros are without noise here, so the
    error needs no filter of 2.5 Hz).  AutoTune's results for vehicles of this kind in ArduPilot's
    published parameter files are a P of 1.2 and a D of 0.022 (Holybro X500 v2) and a P of 1.0
    (Parrot Bebop).  ``ATC_ACCEL_Y_MAX`` is half of the 190 degrees/s² that the motors can give in
    a hover.  ``docs/results/control.md`` has the step responses of both.
    """
    return replace(
        base or ArduPilotParameters(),
        mot_thst_hover=hover_throttle,
        atc_accel_y_max=math.radians(100),
        atc_rat_yaw=RatePid(p=1.8, i=0.18, d=0.02, flte=20.0, fltd=20.0),
    )
