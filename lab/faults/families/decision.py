"""Faults of decision: when to descend, to wait, to try again, to give up."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from lab.faults.control import ControlSystem, Parameters, Vector
from lab.faults.track import Place
from pytest_garl import Command, Land, Observation, PositionSetpoint

CONTROL = Parameters()


class LandsAtTold(ControlSystem):
    """Lands at the told coordinate if it does not find the pad.

    The report: without strictness a precision landing becomes an ordinary one.
    """

    def not_found(self, at: Vector) -> Command:
        """Land where the mission says."""
        place = self.mission.gps_position_m
        if math.dist(at[:2], place) > self.parameters.commit_offset_m:
            return self.go(place, self.top_m, self.parameters.approach_mps)
        self.phase = "commit"
        self.track.target = place
        return Land(speed_mps=self.parameters.final_mps)


class BlindDescent(ControlSystem):
    """Goes on descending below 5 m when it has lost the pad.

    The report: a landing goes on vertically although the target is lost.
    """

    BLIND_BELOW_M = 5.0

    def land(self, now: float, at: Vector, target: Place) -> Command:
        """Commit where the pad is out of sight below 5 m."""
        lost = now - self.track.seen_s > self.parameters.fresh_s
        if lost and at[2] < self.BLIND_BELOW_M and self.phase in ("descend", "approach"):
            self.phase = "commit"
        return super().land(now, at, target)


class CommitsHigh(ControlSystem):
    """Commits at 5 m, and does not correct the target from there on.

    The report: the last phase of the landing follows the last known place only.
    """

    parameters = dataclasses.replace(CONTROL, commit_height_m=5.0, commit_offset_m=0.6)

    def step(self, observation: Observation) -> Command:
        """Keep the target of the commitment."""
        kept = self.track.target if self.phase == "commit" else None
        command = super().step(observation)
        if kept is not None:
            self.track.target = kept
        return command


class Impatient(ControlSystem):
    """Gives up after two seconds without the pad.

    The report: the advice to take a target for lost after half a second.
    """

    parameters = dataclasses.replace(CONTROL, hold_s=2.0)

    def regain(self, now: float, at: Vector, target: Place, unseen_s: float) -> Command:
        """Give up instead of looking again."""
        return self.give_up()


class HoldsForEver(ControlSystem):
    """Holds above the place of a lost pad for ever.

    The report: a precision landing stays in its horizontal approach, without a timeout.
    """

    def regain(self, now: float, at: Vector, target: Place, unseen_s: float) -> Command:
        """Wait at this height."""
        return self.go(target, at[2], self.parameters.approach_mps)


class TightGate(ControlSystem):
    """Descends only within 3 cm of the pad's axis.

    The report: a copter does not descend while its error exceeds a limit, and gusts exceed it
    always.
    """

    parameters = dataclasses.replace(CONTROL, cone_m=0.03, cone=0.0)


class OneTry(ControlSystem):
    """Counts each lost second as a failed try, and has one try.

    The report: retries are used up at once because the counter is not reset.
    """

    parameters = dataclasses.replace(CONTROL, hold_s=1.0, most_retries=1)


class LostTarget(ControlSystem):
    """Forgets the target as soon as it is lost, and then climbs above it.

    The report: a node dies when there is no marker in front of the camera.
    """

    def regain(self, now: float, at: Vector, target: Place, unseen_s: float) -> Command:
        """Climb above a target that is not there."""
        self.track.forget()
        place: Any = self.track.target
        return PositionSetpoint(position_m=(place[0], place[1], self.top_m), yaw_rad=None)
