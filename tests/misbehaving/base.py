"""What the misbehaving landing systems share: they land as any other does, but for one thing."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pytest_garl.landing_system import (
    Airframe,
    Command,
    Land,
    Mission,
    Observation,
    PositionSetpoint,
)

BEGINS_S = 1.0
"""When the one thing happens: the UAV is in the air by then."""
LANDS_S = 3.0


class Lander:
    """Rises to 1.5 m, and lands where it started: a flight of some seconds, told by no camera."""

    airframe: Any = Airframe(latency_s=0.0)
    needs_camera: Any = False

    def reset(self, mission: Mission) -> None:
        self.home = mission.home_m

    def step(self, observation: Observation) -> Command:
        if observation.time_s > LANDS_S:
            return Land(speed_mps=1.0)
        return PositionSetpoint(position_m=(self.home[0], self.home[1], 1.5))


class Misbehaves(Lander):
    """Does one thing once, after a second; what it returns then goes out instead of a command."""

    comes_to: ClassVar[Literal["finding", "harmless", "either"]] = "finding"

    def reset(self, mission: Mission) -> None:
        super().reset(mission)
        self.done = False

    def step(self, observation: Observation) -> Any:
        if observation.time_s >= BEGINS_S and not self.done:
            self.done = True
            answer = self.misbehave(observation)
            if answer is not None:
                return answer
        return super().step(observation)

    def misbehave(self, observation: Observation) -> Any:
        """Do the one thing."""
        raise NotImplementedError


class Harmless(Misbehaves):
    """Does something that neither this flight nor another may notice."""

    comes_to = "harmless"


class NeighbourLander(Lander):
    """The well-behaved system beside them, with a camera: its flights show what was bent."""

    needs_camera = True

    def step(self, observation: Observation) -> Command:
        # What it sees decides where it goes, so that a bent image bends the flight.
        shade = float(observation.image.mean() + observation.depth_m.mean())
        command = super().step(observation)
        if isinstance(command, PositionSetpoint):
            x, y, z = command.position_m
            return PositionSetpoint(position_m=(x + shade / 1e3, y, z))
        return command
