"""Wrong values in commands, diagnostics, thrusts and airframes."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np

from pytest_garl.landing_system import (
    Airframe,
    AttitudeSetpoint,
    Camera,
    Detection,
    Diagnostics,
    Land,
    MotorThrusts,
    Observation,
    PositionSetpoint,
    VehicleState,
    VelocitySetpoint,
)
from tests.misbehaving.base import Harmless, Lander, Misbehaves

NAN, INF, HUGE = math.nan, math.inf, 10**400


def told(**diagnostics: Any) -> Land:
    return Land(diagnostics=Diagnostics(**diagnostics))


def seen(**changes: Any) -> Land:
    sighting: dict[str, Any] = {"marker_id": 0, "confidence": 1.0, "position_m": (0.0, 0.0, 0.0)}
    return told(detections=(Detection(**sighting | changes),))


def to(*position: Any, **more: Any) -> PositionSetpoint:
    return PositionSetpoint(position_m=position, **more)


class Raises:
    def __str__(self) -> str:
        raise RuntimeError("no text")

    __repr__ = __str__


class DoubtfulConfidence(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return seen(confidence=NAN)


class PathThroughNowhere(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return told(planned_path_m=((0.0, NAN, 0.0),))


class FlatPath(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return told(planned_path_m=((0.0, 1.0),))


class EndlessPath(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return told(planned_path_m=itertools.repeat((0.0, 0.0, 0.0)))


class CornerAtInfinity(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return seen(corners_px=((INF, 0.0),))


class CountsDetections(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return told(detections=5)


class InfiniteMarker(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return seen(marker_id=INF)


class TargetNowhere(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return told(target_m=(0.0, 0.0, NAN))


class PhaseWithoutText(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return told(phase=Raises())


class DiagnosticsOfAnotherKind(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return Land(diagnostics="landing")  # type: ignore[arg-type]


class LongNotes(Harmless):
    def misbehave(self, observation: Observation) -> Any:
        return told(note="n" * 50_000_000, phase="\ud800" * 10**6)


class FloodsTheRecord(Lander):
    airframe = Airframe(latency_s=0.0, camera=Camera(rate_hz=240.0))

    def step(self, observation: Observation) -> Any:
        sighting = Detection(marker_id=0, confidence=1.0, position_m=(0.1, 0.2, 0.3))
        return told(detections=(sighting,) * 100, note="\U0001f6ec" * 1_000)


class SpinsBeyondNumbers(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return AttitudeSetpoint(attitude=(1e200, 0.0, 0.0, 1.0), thrust=0.5)


class NoRotation(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return AttitudeSetpoint(attitude=(0.0, 0.0, 0.0, 0.0), thrust=0.5)


class ThrustBeyondNumbers(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return AttitudeSetpoint(attitude=(0.0, 0.0, 0.0, 1.0), thrust=1e200)


class NoThrust(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return AttitudeSetpoint(attitude=(0.0, 0.0, 0.0, 1.0), thrust=NAN)


class HugeWholeNumber(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return to(HUGE, 0.0, 2.0)


class FarAway(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return to(1e9, 0.0, 2.0)


class PositionOnce(Harmless):
    """Returns a generator, which can be read once."""

    def misbehave(self, observation: Observation) -> Any:
        return PositionSetpoint(position_m=(value for value in (0.0, -16.5, 2.0)))  # type: ignore[arg-type]


class PositionWithoutEnd(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return PositionSetpoint(position_m=itertools.count())  # type: ignore[arg-type]


class PositionInWords(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return PositionSetpoint(position_m="up")  # type: ignore[arg-type]


class PositionAsColumn(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return PositionSetpoint(position_m=np.zeros((3, 1)))  # type: ignore[arg-type]


class PositionInSinglePrecision(Harmless):
    def misbehave(self, observation: Observation) -> Any:
        return PositionSetpoint(position_m=np.array([0, -16.5, 2], np.float32))  # type: ignore[arg-type]


class SomethingElse(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return Raises()


class ATupleForACommand(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return (0.0, 0.0, 2.0)


class TheClassForACommand(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return Land


class NoCommand(Lander):
    def step(self, observation: Observation) -> Any:
        return None


class Promises(Lander):
    """Its step is a coroutine function."""

    async def step(self, observation: Observation) -> Any:  # type: ignore[override]
        return Land()


class BadLand(Land):
    def __getattribute__(self, name: str) -> Any:
        if name == "speed_mps":
            raise ValueError("no speed")
        return super().__getattribute__(name)


class CommandThatRaises(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return BadLand()


class Pretender:
    """Says that it is a Land, and has none of its fields."""

    @property
    def __class__(self) -> Any:
        return Land

    @__class__.setter
    def __class__(self, kind: Any) -> None: ...


class CommandThatPretends(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return Pretender()


class Shifty(float):
    """A number that is another one whenever it is used."""

    def __sub__(self, other: float) -> float:
        return NAN

    __rsub__ = __mul__ = __rmul__ = __add__ = __radd__ = __sub__


class NumbersThatChange(Harmless):
    def misbehave(self, observation: Observation) -> Any:
        return VelocitySetpoint(velocity_mps=(Shifty(), Shifty(), Shifty(0.1)))


class VelocityOfNothing(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return VelocitySetpoint(velocity_mps=(NAN, 0.0, 0.0))


class VelocityInTheComplexPlane(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return VelocitySetpoint(velocity_mps=(1j, 0.0, 0.0))  # type: ignore[arg-type]


class VelocityOfLight(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return VelocitySetpoint(velocity_mps=(3e8, 0.0, 0.0))


class Backwards(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return to(0.0, -16.5, 2.0, speed_mps=-1.0)


class LandsAtNoSpeed(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return Land(speed_mps=0.0)


class TurnsForEver(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return to(0.0, -16.5, 2.0, yaw_rad=INF)


class BigAirframe(Lander):
    airframe = "big"


class LazyAirframe(Lander):
    @property
    def airframe(self) -> Any:
        return 1 / 0


class NoAirframeAtAll(type):
    @property
    def airframe(cls) -> Any:
        raise RuntimeError("no airframe")


class ClassWithoutAirframe(metaclass=NoAirframeAtAll):
    def reset(self, mission: object) -> None: ...

    def step(self, observation: Observation) -> Any:
        return Land()


class TamperedAirframe(Lander):
    """Changes an airframe after it was checked."""

    airframe = Airframe(latency_s=0.0)
    object.__setattr__(airframe, "mass_kg", NAN)


class TamperedCamera(Lander):
    airframe = Airframe(latency_s=0.0, camera=Camera())
    object.__setattr__(airframe.camera, "width_px", 200_000)
    object.__setattr__(airframe.camera, "height_px", 200_000)


class NobodyKnowsWhetherItSees(Lander):
    @property
    def needs_camera(self) -> Any:
        raise RuntimeError("no answer")


class NobodyKnowsWhetherItIsTold(Lander):
    comes_to = "harmless"

    @property
    def observe_truth(self) -> Any:
        raise RuntimeError("no answer")


class TruthIsNoMethod(Lander):
    comes_to = "harmless"
    observe_truth = "please"


class MotorsOfNothing(Lander):
    airframe = Airframe(latency_s=0.0, control_rate_hz=240)

    def control(self, state: VehicleState) -> Any:
        return MotorThrusts(newtons=(NAN, 6.0, 6.0, 6.0))


class HugeMotors(MotorsOfNothing):
    def control(self, state: VehicleState) -> Any:
        return MotorThrusts(newtons=(HUGE, 6.0, 6.0, 6.0))


class ThreeMotors(MotorsOfNothing):
    def control(self, state: VehicleState) -> Any:
        return MotorThrusts(newtons=(6.0, 6.0, 6.0))  # type: ignore[arg-type]


class NoMotors(MotorsOfNothing):
    def control(self, state: VehicleState) -> Any:
        return None


class NoControl(Lander):
    airframe = Airframe(latency_s=0.0, control_rate_hz=240)
