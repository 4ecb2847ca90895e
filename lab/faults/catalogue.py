"""All faults of the suite, by family."""

from __future__ import annotations

from lab.faults.families import (
    avoidance,
    decision,
    estimation,
    flight_control,
    geometry,
    identity,
    perception,
)
from lab.faults.fault import Fault
from lab.faults.placebo import Placebo

GITHUB = "https://github.com/"
ARDUPILOT, PX4 = f"{GITHUB}ArduPilot/ardupilot", f"{GITHUB}PX4/PX4-Autopilot"

IDENTITY = (
    Fault(
        name="any-id",
        family="identity",
        links=(f"{GITHUB}zsiki/Find-GCP/issues/25", f"{GITHUB}RealOrangeOne/zoloto/issues/207"),
        summary="takes every marker of the dictionary for the pad",
        faulty=identity.AnyId,
        fires="I",
    ),
    Fault(
        name="no-margin",
        family="identity",
        links=(f"{GITHUB}opencv/opencv/pull/28289",),
        summary="takes a marker without its white margin for the pad",
        faulty=identity.NoMargin,
        fires="II",
    ),
    Fault(
        name="two-markers",
        family="identity",
        links=(f"{GITHUB}opencv/opencv-python/issues/1185",),
        summary="raises if two markers are in one frame",
        faulty=identity.TwoMarkers,
        fires="V",
    ),
    Fault(
        name="last-seen",
        family="identity",
        links=(
            f"{GITHUB}DebVortex/python-ar-markers/issues/3",
            f"{GITHUB}arturoc/ofxAruco/issues/27",
        ),
        summary="follows the last detection of the list",
        faulty=identity.LastSeen,
        fires="late",
        map="court",
    ),
)
GEOMETRY = (
    Fault(
        name="yaw-sign",
        family="geometry",
        links=(f"{ARDUPILOT}/issues/31651",),
        summary="turns offsets by the negative heading",
        faulty=geometry.YawSign,
        fires="II",
    ),
    Fault(
        name="folded-yaw",
        family="geometry",
        links=(f"{GITHUB}mavlink/mavros/issues/358", f"{GITHUB}mavlink/mavros/pull/2232"),
        summary="folds headings beyond 180 degrees back by half a turn",
        faulty=geometry.FoldedYaw,
        fires="II",
        map="court",
    ),
    Fault(
        name="diagonal",
        family="geometry",
        links=(f"{GITHUB}opencv/opencv_contrib/issues/2811",),
        summary="refuses markers that lie diagonally in the picture",
        faulty=geometry.Diagonal,
        fires="II",
        map="court",
    ),
)
ESTIMATION = (
    Fault(
        name="gate",
        family="estimation",
        links=(f"{PX4}/issues/19830",),
        summary="rejects sightings far from its target for ever",
        faulty=estimation.Gate,
        fires="II",
        map="court",
    ),
    Fault(
        name="mean",
        family="estimation",
        links=(f"{PX4}/issues/12966", f"{PX4}/pull/8755"),
        summary="averages every sighting since the first",
        faulty=estimation.Mean,
        fires="off",
    ),
    Fault(
        name="once",
        family="estimation",
        links=(f"{ARDUPILOT}/pull/31677",),
        summary="locks the pad's place when it confirms it",
        faulty=estimation.Once,
        fires="off",
    ),
    Fault(
        name="unfresh",
        family="estimation",
        links=(f"{GITHUB}goodrobots/vision_landing/issues/34",),
        summary="descends on the last sighting, however old it is",
        faulty=estimation.Unfresh,
        fires="I",
    ),
)
DECISION = (
    Fault(
        name="lands-at-told",
        family="decision",
        links=(f"{ARDUPILOT}/pull/17930",),
        summary="lands at the told coordinate if it does not find the pad",
        faulty=decision.LandsAtTold,
        fires="I",
    ),
    Fault(
        name="blind-descent",
        family="decision",
        links=(f"{GITHUB}ArduPilot/ardupilot_wiki/pull/5598",),
        summary="goes on descending below 5 m when it has lost the pad",
        faulty=decision.BlindDescent,
        fires="I",
    ),
    Fault(
        name="commits-high",
        family="decision",
        links=(f"{PX4}/pull/18973",),
        summary="commits at 5 m and does not correct the target from there on",
        faulty=decision.CommitsHigh,
        fires="off",
        map="court",
    ),
    Fault(
        name="impatient",
        family="decision",
        links=(f"{GITHUB}goodrobots/vision_landing/issues/34",),
        summary="gives up after two seconds without the pad",
        faulty=decision.Impatient,
        fires="II",
        map="court",
    ),
    Fault(
        name="holds-for-ever",
        family="decision",
        links=(f"{PX4}/issues/25096",),
        summary="holds above the place of a lost pad without a timeout",
        faulty=decision.HoldsForEver,
        fires="late",
    ),
    Fault(
        name="tight-gate",
        family="decision",
        links=(f"{ARDUPILOT}/pull/18230", f"{ARDUPILOT}/pull/31677"),
        summary="descends only within 3 cm of the pad's axis",
        faulty=decision.TightGate,
        fires="late",
    ),
    Fault(
        name="one-try",
        family="decision",
        links=(f"{ARDUPILOT}/pull/17930",),
        summary="counts each lost second as a failed try, and has one",
        faulty=decision.OneTry,
        fires="II",
        map="court",
    ),
    Fault(
        name="lost-target",
        family="decision",
        links=(
            f"{GITHUB}RIVeR-Lab/apriltags_ros/issues/34",
            f"{GITHUB}AprilRobotics/apriltag/issues/320",
        ),
        summary="raises when it has lost the pad for 4 s",
        faulty=decision.LostTarget,
        fires="V",
    ),
)
CONTROL = (
    Fault(
        name="fast-touchdown",
        family="control",
        links=(f"{ARDUPILOT}/issues/17706", f"{ARDUPILOT}/issues/6460"),
        summary="descends at 2.4 m/s until the altimeter says 0.9 m",
        faulty=flight_control.FastTouchdown,
        fires="hard",
    ),
    Fault(
        name="low-tilt",
        family="control",
        links=(f"{PX4}/issues/11473", f"{ARDUPILOT}/issues/10565"),
        summary="limits the tilt to 5 degrees",
        faulty=flight_control.LowTilt,
        fires="II",
        map="court",
    ),
    Fault(
        name="motors-off",
        family="control",
        links=(f"{PX4}/issues/14171", f"{GITHUB}iNavFlight/inav/issues/219"),
        summary="stops the motors where the altimeter says that it stands",
        faulty=flight_control.MotorsOff,
        fires="hard",
        map="court",
    ),
)
PERCEPTION = (
    Fault(
        name="fixed-threshold",
        family="perception",
        links=(f"{GITHUB}kig/JSARToolKit/issues/17",),
        summary="binarises pictures at a fixed grey",
        faulty=perception.FixedThreshold,
        fires="II",
    ),
    Fault(
        name="gain",
        family="perception",
        links=(f"{GITHUB}boltgolt/howdy/issues/413", f"{GITHUB}aivazis/qed/issues/81"),
        summary="divides by the brightness of a black picture",
        faulty=perception.Gain,
        fires="V",
        map="court",
    ),
)
AVOIDANCE = (
    Fault(
        name="no-watch",
        family="avoidance",
        links=(f"{GITHUB}PX4/PX4-Avoidance/issues/621",),
        summary="looks at nothing but the marker",
        faulty=avoidance.NoWatch,
        fires="IV",
    ),
    Fault(
        name="zero-depth",
        family="avoidance",
        links=(
            f"{GITHUB}realsenseai/librealsense/issues/2501",
            f"{GITHUB}realsenseai/librealsense/issues/10224",
        ),
        summary="takes a depth of 0, no measurement, for an obstacle",
        faulty=avoidance.ZeroDepth,
        fires="II",
        map="court",
    ),
    Fault(
        name="narrow",
        family="avoidance",
        links=(f"{GITHUB}yankailab/OpenKAI/issues/31",),
        summary="looks straight below only",
        faulty=avoidance.Narrow,
        fires="IV",
        map="court",
    ),
    Fault(
        name="stops-watching",
        family="avoidance",
        links=(f"{GITHUB}PX4/PX4-user_guide/pull/510",),
        summary="ignores what comes into the way once it has committed",
        faulty=avoidance.StopsWatching,
        fires="IV",
    ),
    Fault(
        name="low-transit",
        family="avoidance",
        links=(f"{PX4}/issues/22549", f"{GITHUB}3drobotics/ardupilot-solo/pull/115"),
        summary="flies to the pad at 4.5 m, below the tops of trees",
        faulty=avoidance.LowTransit,
        fires="III",
    ),
)
FAULTS: tuple[Fault, ...] = (
    *IDENTITY,
    *GEOMETRY,
    *ESTIMATION,
    *DECISION,
    *CONTROL,
    *PERCEPTION,
    *AVOIDANCE,
)
"""Every fault; the names are unique."""


PLACEBO = Fault(
    name="placebo",
    family="none",
    links=(),
    summary="approaches the pad one percent faster, which is no fault",
    faulty=Placebo,
    fires="IV",
)
"""How often chance finds something; no fault of the suite, and without a scenario."""


def fault_named(name: str) -> Fault:
    """Return a fault of the suite, or the placebo."""
    return next(each for each in (*FAULTS, PLACEBO) if each.name == name)
