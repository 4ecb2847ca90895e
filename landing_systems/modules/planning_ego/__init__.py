"""Ego-Planner, a local planner without distance field, written anew in NumPy and SciPy.

After X. Zhou, Z. Wang, C. Xu and F. Gao, "EGO-Planner: An ESDF-free Gradient-based Local
Planner for Quadrotors", IEEE Robotics and Automation Letters 6(2), 2021; no code of theirs is
used.  It needs nothing of a landing system but its observations::

    planner = EgoPlanner(LANDING, camera, centre_m=(0.0, 0.0))
    planner.observe(observation)                      # each camera frame
    planner.set_goal((x, y, z))                       # when there is one, or each frame
    setpoint = planner.plan(time_s, position_m, velocity_mps)

Reproduced: the log-odds grid from depth images with its inflation; uniform cubic B-splines;
collision segments, A* guides and {p, v} pairs; the terms for smoothness, collision and
feasibility; the rebound from obstacles that are met during the optimisation by L-BFGS; the
restarts with twice the collision's weight; the re-allocation of time with the anisotropic
fitness; the machine of six states with its safety check and emergency stop; upstream's
parameters as defaults, and its refusal to plan where the trajectory's end is in an obstacle.

Different, each for the reason given where it is done: the global path is a straight line
instead of a minimum-snap polynomial; initial paths are timed by a trapezoid, and retries go
left, right and above instead of by chance; start and end states are met exactly; limits hold
for vectors, not for each axis; rays are followed backwards, which gives the same misses; one
hit outweighs the misses of a frame; L-BFGS starts from the smoothness' Hessian; a search for a
guide ends after so many nodes, not after so much time.  Added, and off in the defaults: a
lower vertical speed, a least height for detours, moving a local target out of an obstacle,
forgetting what has moved on, leaving an obstacle's inflation, replanning when far off the
trajectory.

Not reproduced: the ROS nodes, the server that turns trajectories into attitude commands, the
yaw (the caller's), the topological search of its successor, and swarms.

Limits.  A camera that looks down does not see what is beside or above the UAV, and what was
never seen counts as free, as upstream: flown low through country it has not looked at from above,
the planner meets a wall that is higher than the UAV when it is too late.  Cross at a height above
everything, and descend into what has been seen.  Obstacles do not move in its plans: they are
where the latest frames have shown them.
"""

from landing_systems.modules.planning_ego.errors import (
    GoalInObstacleError,
    NoTrajectoryError,
    PlannerError,
)
from landing_systems.modules.planning_ego.parameters import LANDING, EgoParameters
from landing_systems.modules.planning_ego.planner import EgoPlanner, Setpoint

__all__ = [
    "LANDING",
    "EgoParameters",
    "EgoPlanner",
    "GoalInObstacleError",
    "NoTrajectoryError",
    "PlannerError",
    "Setpoint",
]
