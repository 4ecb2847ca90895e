"""What may vary in a scenario, one table per cause, in the order in which files list them.

To add a condition, add a quantity to a table here, or a table to ``GROUPS``, and read it where it
acts: ``scenario["wind.mean_mps"]``.
"""

from __future__ import annotations

import math

from pytest_garl.scenarios.quantities import Group, Quantity

MOMENTS = ("start", "8 m", "3 m", "touchdown", "readable", "lost")
"""What an event or the story of an NPC waits for: the start of the flight; the UAV's descent
through a height; its touchdown; the first picture in which the marker could be read; the end of the
first time in which it could (:mod:`pytest_garl.simulation.landing_moments`)."""
DESCENT = MOMENTS[:4]
"""Those that the UAV's height tells."""
DECIDED = "decided"
EVENT_MOMENTS = (*MOMENTS, DECIDED)
"""What an event waits for: a moment of the landing, or the decision of the learned director, in
flight (:mod:`pytest_garl.simulation.strikes`)."""
FOG_VISIBILITY_M = 10.0
"""Gene 1: below 10 m were reported in the Great Smog of London, 1952."""
DUST_VISIBILITY_M = 20.0
"""Gene 1: engineering estimate, far below the 500 m at which a dust storm counts as heavy
(ICAO 2009)."""
RAIN_MMPH = 100.0
"""Gene 1: twice the 50 mm/h from which the WMO calls rain violent."""
SNOW_MMPH = 10.0
"""Gene 1: water equivalent; twice the 5 mm/h from which the WMO calls snow heavy."""
LEAVES_PER_M3 = 2.0
"""Gene 1: engineering estimate of a gust through an autumn maple."""
_COVER_SOURCE = "the paper's gene, a share"
WEATHER = {
    "environment.dust": Quantity(
        key="weather.dust_visibility_m",
        low=DUST_VISIBILITY_M,
        high=math.inf,
        nominal=math.inf,
        scale="inverse",
        meaning="how far one sees through dust",
        source="ICAO 2009: a dust storm is heavy below 500 m",
    ),
    "environment.fog": Quantity(
        key="weather.fog_visibility_m",
        low=FOG_VISIBILITY_M,
        high=math.inf,
        nominal=math.inf,
        scale="inverse",
        meaning="how far one sees through fog",
        source="below 10 m in the Great Smog of London, 1952",
    ),
    "environment.rain": Quantity(
        key="weather.rain_mmph",
        low=0.0,
        high=RAIN_MMPH,
        meaning="falling rain",
        source="WMO: violent from 50 mm/h",
    ),
    "environment.snow": Quantity(
        key="weather.snow_mmph",
        low=0.0,
        high=SNOW_MMPH,
        meaning="falling snow, as water",
        source="WMO: heavy from 5 mm/h",
    ),
    "environment.road_wetness": Quantity(
        key="weather.wetness_percent",
        low=0.0,
        high=100.0,
        meaning="wetness of the ground",
        source=_COVER_SOURCE,
    ),
    "environment.maple_leaf": Quantity(
        key="weather.falling_leaves_per_m3",
        low=0.0,
        high=LEAVES_PER_M3,
        meaning="falling maple leaves",
        source="engineering estimate of a gust through an autumn maple",
    ),
    "environment.road_leaf": Quantity(
        key="weather.leaf_cover_percent",
        low=0.0,
        high=100.0,
        meaning="share of the ground under leaves",
        source=_COVER_SOURCE,
    ),
    "environment.road_snow": Quantity(
        key="weather.snow_cover_percent",
        low=0.0,
        high=100.0,
        meaning="share of the ground under snow",
        source=_COVER_SOURCE,
    ),
}
"""The weather by the paper's eight genes, which are shares of the strongest effect; 0 is clear."""
WEATHER_CAUSES = {
    "dust": ("dust",),
    "fog": ("fog",),
    "rain": ("rain", "road_wetness"),
    "snow": ("snow", "road_snow"),
    "leaves": ("maple_leaf", "road_leaf"),
}
"""Weather genes that one cause switches on together: rain wets the ground, snow covers it."""

LIGHT = Group(
    name="light",
    meaning="the sun's elevation and azimuth",
    quantities=(
        Quantity(
            key="light.turn_deg",
            even=True,
            low=-180.0,
            high=180.0,
            meaning="turn of the sun about the vertical, off its way from east to west",
            source="any direction: pads and cameras face every way",
        ),
    ),
)

WIND = Group(
    name="wind",
    meaning="wind over the pad",
    quantities=(
        Quantity(
            key="wind.mean_mps",
            low=0.0,
            high=15.0,
            meaning="mean speed at a height of 6 m",
            source="DJI Matrice 100 data sheet: resists 10 m/s, gusts included",
        ),
        Quantity(
            key="wind.towards_deg",
            even=True,
            low=0.0,
            high=360.0,
            meaning="direction in which the air moves (0: east, 90: north)",
            source="any direction",
        ),
        Quantity(
            key="wind.turbulence",
            low=0.0,
            high=1.5,
            meaning="intensity of gusts as a factor on MIL-F-8785C at low altitude",
            source="MIL-F-8785C: 1 is what the standard expects at that mean",
        ),
    ),
)

_ANY = "any direction"
NAVIGATION = Group(
    name="navigation",
    meaning="error of the estimated state, which wanders slowly",
    quantities=(
        Quantity(
            key="navigation.position_m",
            low=0.0,
            high=10.0,
            meaning="horizontal error of the estimated position: at the start, and its root mean "
            "square",
            source="u-blox M8 data sheet: 2.5 m CEP with GPS and GLONASS",
        ),
        Quantity(
            key="navigation.towards_deg",
            low=0.0,
            high=360.0,
            even=True,
            meaning="direction of that error at the start (0: east, 90: north)",
            source=_ANY,
        ),
        Quantity(
            key="navigation.height_m",
            low=0.0,
            high=5.0,
            meaning="root mean square of the error of the estimated height; none at the start",
            source="MS5611 data sheet: 10 cm resolution; Sabatini and Genovese 2014: barometers "
            "drift by decimetres in minutes",
        ),
        Quantity(
            key="navigation.yaw_deg",
            low=-45.0,
            high=45.0,
            meaning="error of the estimated heading: at the start, and its root mean square",
            source="PX4, COM_ARM_EKF_YAW: arms up to 0.5 rad; a compass near motors errs by some "
            "degrees",
        ),
        Quantity(
            key="navigation.tilt_deg",
            low=0.0,
            high=10.0,
            meaning="error of the estimated roll and pitch: at the start, and its root mean square",
            source="Matrice 100 user manual: hovering accuracy needs a calibrated IMU; "
            "Xsens MTi-3 data sheet: 0.8 to 1 degree RMS, twice that after a hard landing",
        ),
        Quantity(
            key="navigation.tilt_towards_deg",
            low=0.0,
            high=360.0,
            even=True,
            meaning="direction in which the tilt errs at the start (0: nose down, 90: right down)",
            source=_ANY,
        ),
        Quantity(
            key="navigation.correlation_s",
            nominal=300.0,
            low=30.0,
            high=600.0,
            even=True,
            meaning="correlation time of the errors",
            source="Rankin 1994: GPS errors as Gauss-Markov processes of minutes",
        ),
    ),
)


def _after(event: str) -> Quantity:
    return Quantity(
        key=f"{event}.after",
        even=True,
        low=0.0,
        high=len(EVENT_MOMENTS) - 1.0,
        whole=True,
        choices=EVENT_MOMENTS,
        meaning="the moment of the landing from which from_s counts",
        source="what goes wrong depends on what the UAV does when it happens, not on the clock",
    )


def _begin(event: str) -> Quantity:
    return Quantity(
        key=f"{event}.from_s",
        even=True,
        low=0.0,
        high=300.0,
        meaning="when it begins, after its moment; it does not count if the director decides",
        source="a landing takes some 10 to 40 s",
    )


JUMP = Group(
    name="jump",
    meaning="a jump of the estimated position",
    quantities=(
        _after("jump"),
        _begin("jump"),
        Quantity(
            key="jump.distance_m",
            low=0.0,
            high=20.0,
            meaning="how far it jumps; it stays there",
            source="ArduPilot, EK3_GLITCH_RAD: the filter resets its position when GPS is 25 m "
            "away; multipath moves GPS by metres",
        ),
        Quantity(
            key="jump.towards_deg",
            low=0.0,
            high=360.0,
            even=True,
            meaning="direction of the jump (0: east, 90: north)",
            source=_ANY,
        ),
    ),
)

TOLD = Group(
    name="told",
    meaning="the coordinate that the mission gives",
    quantities=(
        Quantity(
            key="told.surveyed",
            even=True,
            low=0.0,
            high=1.0,
            whole=True,
            meaning="whether the pad was surveyed: if so (1), the coordinate is the marker's and "
            "has an error; if not (0), it is the map's, wherever the marker lies",
            source="0 is the paper's world: the marker lies up to 7.5 m from the coordinate",
        ),
        Quantity(
            key="told.error_m",
            low=0.0,
            high=20.0,
            meaning="error of the coordinate",
            source="u-blox M8 data sheet: 2.5 m CEP; twice that for a pad surveyed with a phone",
        ),
        Quantity(
            key="told.towards_deg",
            even=True,
            low=0.0,
            high=360.0,
            meaning="direction of the error, counter-clockwise from east",
            source="any direction",
        ),
    ),
)

TIMING = Group(
    name="timing",
    meaning="late, uneven and lost frames, and wrong stamps",
    quantities=(
        Quantity(
            key="timing.latency_ms",
            low=0.0,
            high=1000.0,
            meaning="delay of every frame beyond the latency that the airframe declares",
            source="ArduPilot pull request 7046: 50 to 200 ms in most visual landing systems",
        ),
        Quantity(
            key="timing.jitter_ms",
            low=0.0,
            high=500.0,
            meaning="further delay, drawn for each frame from 0 to this; frames keep their order",
            source="PX4 pull request 9050: 20 to 50 ms of varying latency at a high frame rate; "
            "zed-ros-wrapper issue 581: 18 to 47 ms between frames at 30 Hz",
        ),
        Quantity(
            key="timing.dropped_percent",
            low=0.0,
            high=95.0,
            meaning="share of frames that are lost: the landing system is not called",
            source="rpicam-apps issue 157: 7 % lost; librealsense issue 14928: 32 % lost",
        ),
        Quantity(
            key="timing.stamp_error_ms",
            low=-500.0,
            high=500.0,
            meaning="how much later than the picture the pose is that comes with it, and the stamp",
            source="ArduPilot pull request 7046: the attitude of another moment, 50 to 200 ms off, "
            "is used for a picture; half of that",
        ),
    ),
)


def _mounting(axis: str, meaning: str) -> Quantity:
    return Quantity(
        key=f"camera.mounting_{axis}_deg",
        low=-15.0,
        high=15.0,
        meaning=f"true camera turned from the declared one: {meaning}; the depth camera with it",
        source="engineering estimate: a bracket mounted by hand, without a calibration",
    )


CAMERA = Group(
    name="camera",
    meaning="a camera that differs from what the airframe says",
    quantities=(
        _mounting("roll", "it looks to the left"),
        _mounting("pitch", "it looks backwards"),
        _mounting("yaw", "the image's top turns to the left"),
        Quantity(
            key="camera.calibration_error_percent",
            low=-20.0,
            high=20.0,
            meaning="by how much the true focal length is longer than that of Camera.matrix",
            source="engineering estimate: the nominal focal length instead of a calibrated one",
        ),
        Quantity(
            key="camera.exposure_ms",
            low=0.0,
            high=100.0,
            meaning="exposure time, at most the time between two frames: the UAV's own movement "
            "during it blurs the picture; its brightness stays as it is; 0: no blur",
            source="libcamera's tuning for the Raspberry Pi's cameras: in low light the time grows "
            "from 0.1 over 10, 30 and 60 to 66.7 ms while the gain does (ethoscope issue 222 "
            "measured 66.7 ms); 33 ms is the most at 30 Hz; picamera2 issue 1077 sets 0.2 ms to "
            "land on a marker",
        ),
        Quantity(
            key="camera.dirt_percent",
            low=0.0,
            high=80.0,
            meaning="share of the picture behind soft patches of dirt on the lens, which stay for "
            "the flight; the depth camera is clean",
            source="Gu et al. 2009 for the effect: dirt attenuates and scatters, out of focus; the "
            "share is an engineering estimate: drops and dust of a dusty or muddy pad",
        ),
    ),
)

NO_LIMIT_M = 100.0
DEPTH = Group(
    name="depth",
    meaning="a depth camera with a limited reach, and with holes",
    feeds="depth_m",
    quantities=(
        Quantity(
            key="depth.range_m",
            nominal=NO_LIMIT_M,
            low=1.0,
            high=NO_LIMIT_M,
            meaning="reach of the depth camera in clear air, less in fog, rain and snow; beyond it "
            "the depth is 0; 100: no limit in any weather",
            source="Intel RealSense D400 series data sheet: about 10 m, which varies with light "
            "and calibration; the lidar equation for the air",
        ),
        Quantity(
            key="depth.holes_percent",
            low=0.0,
            high=90.0,
            meaning="mean share of the picture in which nothing is measured, in patches that "
            "change within about half a second; the depth there is 0",
            source="librealsense issues 10769: depth of grassy and stony ground is patchy; 10229: "
            "holes on reflecting ground; 11286: a depth of 0 without a measurement; the end of the "
            "range is an engineering estimate",
        ),
    ),
)

CLEARANCE = Quantity(
    key="pad.clearance_m",
    nominal=1.3,
    low=0.6,
    high=1.3,
    meaning="least distance from the marker's middle to obstacles, seen from above, that the "
    "choice of its place keeps; 1.3: its corners are 0.25 m away from them, whatever its size",
    source="0.6 m: half of a UAV of 1 m and 0.1 m; ISO 34503 leaves the pad's surroundings to the "
    "user",
)
PAD = Group(
    name="pad",
    meaning="a marker that lies turned, worn or near obstacles",
    quantities=(
        Quantity(
            key="pad.yaw_deg",
            even=True,
            acts_alone=True,
            low=-180.0,
            high=180.0,
            meaning="turn of the marker, counter-clockwise; at 0 its top is north",
            source="any direction",
        ),
        Quantity(
            key="pad.worn_percent",
            low=0.0,
            high=20.0,
            meaning="share of border and bits that is worn off in patches: the ground shows",
            source="ASTM D913: wear bares the substrate, graded by the share that is left; 20 % is "
            "an engineering estimate of when a pad is painted again",
        ),
        CLEARANCE,
    ),
)

DECOY_KINDS = (
    "none",
    "other-id",
    "same-id-without-margin",
    "helipad-h",
    "chequered-mat",
    "window",
    "grate",
    "qr-code",
)
"""What the numbers of ``kind`` mean."""
DECOY_REACH_M = 7.5


def _place(decoy: str, axis: str, direction: str) -> Quantity:
    return Quantity(
        key=f"{decoy}.{axis}_m",
        even=True,
        low=-DECOY_REACH_M,
        high=DECOY_REACH_M,
        meaning=f"how far {direction} of the map's coordinate its middle lies; moved off the "
        "marker and other decoys",
        source="the disc in which the marker may lie",
    )


def _decoy(number: int) -> Group:
    name = f"decoy-{number}"
    return Group(
        name=name,
        meaning="a thing on the ground that could be taken for the marker",
        quantities=(
            Quantity(
                key=f"{name}.kind",
                even=True,
                choices=DECOY_KINDS,
                low=0.0,
                high=float(len(DECOY_KINDS) - 1),
                meaning=", ".join(f"{index}: {kind}" for index, kind in enumerate(DECOY_KINDS)),
                source="other ids of the family: personalrobotics/apriltags issue 18; a missing "
                "margin: opencv_contrib issue 1698; H: ICAO Annex 14; boards of squares: opencv "
                "issue 24117; windows: zoloto issue 207; things on the ground: apriltag issue 361; "
                "high-contrast patterns, of which a grate and a QR code are two: "
                "personalrobotics/apriltags issue 18",
            ),
            _place(name, "x", "east"),
            _place(name, "y", "north"),
            Quantity(
                key=f"{name}.yaw_deg",
                even=True,
                low=-180.0,
                high=180.0,
                meaning="its turn, counter-clockwise",
                source="any direction",
            ),
        ),
    )


DECOYS = tuple(_decoy(number) for number in (1, 2, 3))


def _lasts(event: str, source: str) -> Quantity:
    return Quantity(
        key=f"{event}.lasts_s", low=0.0, high=60.0, meaning="how long it lasts", source=source
    )


OUTAGE = Group(
    name="outage",
    meaning="a camera that fails for some seconds",
    quantities=(
        _after("outage"),
        _begin("outage"),
        _lasts(
            "outage",
            "ArduPilot, AC_PrecLand: a landing target is lost after 2 s without a measurement; "
            "PX4, PLD_BTOUT: after 5 s",
        ),
        Quantity(
            key="outage.frozen",
            even=True,
            low=0.0,
            high=1.0,
            whole=True,
            meaning="0: black pictures without depth; 1: the last picture again and again",
            source="a sensor without data, or a driver that repeats its buffer",
        ),
    ),
)
BURST = Group(
    name="burst",
    meaning="a burst of delay: frames queue up and arrive late, in order",
    quantities=(
        _after("burst"),
        _begin("burst"),
        _lasts("burst", "PX4, PLD_BTOUT: a landing target counts as lost after 5 s"),
        Quantity(
            key="burst.latency_ms",
            low=0.0,
            high=5000.0,
            meaning="delay of the frames that are taken during the burst, beyond timing.latency_ms",
            source="ArduPilot, AC_PrecLand: half of the 2 s after which a target is lost",
        ),
    ),
)
COVER = Group(
    name="cover",
    meaning="a tarpaulin that lies over a part of the marker for some seconds",
    quantities=(
        _after("cover"),
        _begin("cover"),
        _lasts(
            "cover",
            "ArduPilot, AC_PrecLand, loses a landing target after 2 s; a gust moves things on",
        ),
        Quantity(
            key="cover.share_percent",
            low=0.0,
            high=100.0,
            meaning="share of the marker's width that it hides, from the marker's left side on",
            source="any share: engineering estimate; ArUco reads no marker with a hidden corner",
        ),
    ),
)
HEADING = Group(
    name="heading",
    meaning="heading of the UAV at the start",
    quantities=(
        Quantity(
            key="heading.start_deg",
            even=True,
            low=-180.0,
            high=180.0,
            meaning="direction of the nose at the start (0: east, 90: north)",
            source="any direction",
        ),
    ),
)

GROUPS: dict[str, Group] = {
    each.name: each
    for each in (
        LIGHT,
        WIND,
        NAVIGATION,
        JUMP,
        TOLD,
        TIMING,
        CAMERA,
        DEPTH,
        PAD,
        *DECOYS,
        OUTAGE,
        BURST,
        COVER,
        HEADING,
    )
}
"""All groups of conditions but the weather, in the order in which files list them."""
QUANTITIES: dict[str, Quantity] = {
    each.key: each for group in GROUPS.values() for each in group.quantities
}
"""Their quantities by key."""
EVENTS = tuple(name for name in GROUPS if f"{name}.after" in QUANTITIES)
"""The groups that begin at a moment of the landing."""
