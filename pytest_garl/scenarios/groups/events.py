"""Events during the flight, each a group of its own because each has a cause of its own."""

from __future__ import annotations

from pytest_garl.scenarios.groups.parameter import Group, Parameter

_BEGIN = Parameter(
    name="from_s",
    even=True,
    nominal=0.0,
    low=0.0,
    high=300.0,
    meaning="when it begins, after the start of the flight",
    source="a landing takes some 10 to 40 s",
)


def _lasts(source: str) -> Parameter:
    return Parameter(
        name="lasts_s", nominal=0.0, low=0.0, high=60.0, meaning="how long it lasts", source=source
    )


OUTAGE = Group(
    name="outage",
    meaning="a camera that fails for some seconds",
    parameters=(
        _BEGIN,
        _lasts(
            "ArduPilot, AC_PrecLand: a landing target is lost after 2 s without a measurement; "
            "PX4, PLD_BTOUT: after 5 s"
        ),
        Parameter(
            name="frozen",
            even=True,
            nominal=0.0,
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
    parameters=(
        _BEGIN,
        _lasts("PX4, PLD_BTOUT: a landing target counts as lost after 5 s"),
        Parameter(
            name="latency_ms",
            nominal=0.0,
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
    parameters=(
        _BEGIN,
        _lasts("ArduPilot, AC_PrecLand, loses a landing target after 2 s; a gust moves things on"),
        Parameter(
            name="share_percent",
            nominal=0.0,
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
    parameters=(
        Parameter(
            name="start_deg",
            even=True,
            nominal=0.0,
            low=-180.0,
            high=180.0,
            meaning="direction of the nose at the start (0: east, 90: north)",
            source="any direction",
        ),
    ),
)
GROUPS = (OUTAGE, BURST, COVER, HEADING)
