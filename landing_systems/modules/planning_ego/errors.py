"""Errors of the planner; ego-planner, which this reimplements, only prints them."""

from __future__ import annotations


class PlannerError(Exception):
    """The planner has no trajectory.

    The planner does not raise it but stores it in the setpoint, and tries again in the next step,
    as ego-planner does.  A landing system may raise it.
    """


class GoalInObstacleError(PlannerError):
    """The trajectory would have to end within an inflated obstacle, so planning is skipped."""


class NoTrajectoryError(PlannerError):
    """No initial path led to a trajectory that is free of collisions."""
