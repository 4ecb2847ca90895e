"""Why the planner has no trajectory; upstream only prints these."""

from __future__ import annotations


class PlannerError(Exception):
    """Base of what keeps the planner from planning.

    A setpoint carries it and a landing system may raise it; the planner itself goes on
    trying, as upstream does.
    """


class GoalInObstacleError(PlannerError):
    """The trajectory would have to end within an inflated obstacle, so planning is skipped."""


class NoTrajectoryError(PlannerError):
    """No initial path led to a trajectory that is free of collisions."""
