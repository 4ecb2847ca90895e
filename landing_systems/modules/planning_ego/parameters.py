"""Every constant of the planner: upstream's defaults, and those of the landing system.

The defaults are upstream's.  Sources: [L] the parameters in the launch files of
https://github.com/ZJU-FAST-Lab/ego-planner, [C] a constant of its program, [P] the paper,
[O] ours, chosen so that the default changes nothing of upstream's behaviour.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields


@dataclass(frozen=True, slots=True, kw_only=True)
class EgoParameters:
    """All settings of the planner; lengths in metres, times in seconds.

    Raises ValueError for a value that is no number, or beyond its limits.
    """

    # Motion
    max_vel_mps: float = 2.0
    """Top speed, as a vector's length. [L] manager/max_vel (there per axis)."""
    max_vertical_vel_mps: float | None = None
    """Top climb and descent; ``None`` is ``max_vel_mps``. [O]"""
    max_acc_mps2: float = 3.0
    """Largest acceleration, as a vector's length. [L] manager/max_acc (there per axis)."""
    feasibility_tolerance: float = 0.05
    """Speed and acceleration may exceed their limits by this share.
    [L] manager/feasibility_tolerance."""

    # Replanning
    planning_horizon_m: float = 7.5
    """Distance to the local target. [L] fsm/planning_horizon."""
    replan_distance_m: float = 1.5
    """Fly this far on a trajectory before planning the next. [L] fsm/thresh_replan."""
    no_replan_distance_m: float = 2.0
    """Nearer to the goal than this, keep the trajectory. [L] fsm/thresh_no_replan."""
    emergency_time_s: float = 1.0
    """Stop when a collision is nearer than this and no plan avoids it. [L] fsm/emergency_time."""
    emergency_exit_speed_mps: float = 0.1
    """An emergency stop ends below this speed. [C]"""
    init_tries: int = 3
    """Different initial paths that are tried before planning has failed. [C]"""
    checked_share: float = 2 / 3
    """The share of a trajectory that must be free, unless it ends at the goal: what is farther
    will be planned again. [C]"""
    target_shift_m: float = 0.0
    """A local target within an obstacle moves along the global path by up to this; 0 does
    not move it, so that planning fails. [O]"""
    goal_change_m: float = 1e-3
    """A goal that moves by less is the same goal. [O]"""
    max_deviation_m: float = math.inf
    """Replan from where the UAV is if it is farther off its trajectory than this. [O]"""
    lookahead_s: float = 0.0
    """The setpoint is the trajectory's at this much later, to make up for latency. [O]"""

    # Occupancy grid
    resolution_m: float = 0.1
    """Side of a cell. [L] grid_map/resolution."""
    map_size_m: tuple[float, float, float] = (40.0, 40.0, 3.0)
    """Size of the grid, (x, y) about its centre and z from the ground. [L] grid_map/map_size."""
    update_range_m: tuple[float, float, float] = (5.5, 5.5, 4.5)
    """Half sizes of the box about the camera that a frame updates.
    [L] grid_map/local_update_range."""
    ground_height_m: float = -0.01
    """The grid's lower end: what is lower is ground and no obstacle. [L] grid_map/ground_height."""
    ceiling_m: float = 2.5
    """Nothing flies above this. [L] grid_map/virtual_ceil_height."""
    min_height_m: float = -math.inf
    """No way round an obstacle leads below this, unless start or goal is lower. [O]"""
    inflation_m: float = 0.099
    """Obstacles grow by this, rounded up to cells, as a cube. [L] grid_map/obstacles_inflation."""
    vertical_inflation_m: float | None = None
    """Growth in z; ``None`` is ``inflation_m``. [O]"""
    fill_below: bool = False
    """What is below something solid is occupied as well, for a camera that sees only tops. [O]"""
    p_hit: float = 0.65
    p_miss: float = 0.35
    p_min: float = 0.12
    p_max: float = 0.90
    p_occupied: float = 0.80
    """Sensor model, clamps and threshold of the log-odds. [L] grid_map/p_*."""
    min_depth_m: float = 0.2
    """Nearer returns are ignored. [L] grid_map/depth_filter_mindist."""
    max_ray_m: float = 4.5
    """Longer rays say nothing but that they are free up to here. [L] grid_map/max_ray_length."""
    pixel_step: int = 2
    """Every n-th row and column gives rays. [L] grid_map/skip_pixel."""
    pixel_margin: int = 1
    """Pixels left out at the image's border. [L] grid_map/depth_filter_margin."""
    camera_offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """The camera's place in the body frame. [O]"""
    forget_after_s: float | None = None
    """Forget what was not seen again for so long; ``None`` keeps it for ever, as upstream. [O]"""
    static_after_s: float = math.inf
    """What stood in one place for so long before it left the view is never forgotten. [O]"""

    # Spline and optimisation
    control_point_distance_m: float = 0.4
    """Spacing of the spline's control points. [L] manager/control_points_distance."""
    time_factor: float = 1.2
    """The knot span is this times the spacing over the top speed. [C]"""
    min_samples: int = 7
    """Samples of an initial path, at least. [C]"""
    clearance_m: float = 0.5
    """Wanted distance of control points from the inflated obstacle. [L] optimization/dist0."""
    weight_smoothness: float = 1.0
    weight_collision: float = 0.5
    weight_feasibility: float = 0.1
    weight_fitness: float = 1.0
    """[L] optimization/lambda_smooth, _collision, _feasibility, _fitness."""
    fitness_axial: float = 25.0
    fitness_radial: float = 1.0
    """Squared half axes of the fitness term's ellipse: leaving the path sideways costs 25 times
    as much as being early or late on it. [C]"""
    memory: int = 16
    max_iterations: int = 200
    gradient_tolerance: float = 0.01
    """L-BFGS: remembered steps, iterations, gradient at which it ends. [C]"""
    min_rebound_iterations: int = 3
    """Iterations before the first look for new obstacles. [C]"""
    max_rebounds: int = 20
    """Times that newly met obstacles are added to one optimisation. [C]"""
    max_restarts: int = 3
    """Restarts with the collision's weight doubled. [C]"""
    time_ratio_limit: float = 1.1
    """Slow down by at most this in one step of the time's re-allocation. [C]"""
    max_reallocations: int = 12
    """Steps of re-allocation, at most; 12 slow down threefold. [O]"""

    # Guides
    astar_max_nodes: int = 100_000
    """Nodes that one search for a guide expands; upstream's pool is 100³ cells and it stops
    after 0.2 s, which would make results depend on the machine. [O]"""
    astar_step: int = 1
    """Cells from one node of the search to the next; all between them must be free. [O]"""
    astar_weight: float = 1.0001
    """Factor on the heuristic: the search is greedy for more than one. Upstream's breaks ties
    only. [C]"""

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            for number in value if isinstance(value, tuple) else (value,):
                if number is not None and math.isnan(number):
                    raise ValueError(f"{item.name} is not a number")
        for name in _POSITIVE:
            value = getattr(self, name)
            for number in value if isinstance(value, tuple) else (value,):
                if number is not None and number <= 0:
                    raise ValueError(f"{name} is {value}; expected more than 0")
        if not 0 < self.p_min < self.p_occupied < self.p_max < 1:
            raise ValueError(
                f"p_min, p_occupied, p_max are {self.p_min}, {self.p_occupied}, {self.p_max}; "
                "expected them to rise within 0 and 1"
            )
        if not 0 < self.p_miss < 0.5 < self.p_hit < 1:
            raise ValueError(
                f"p_miss and p_hit are {self.p_miss} and {self.p_hit}; "
                "expected p_miss below and p_hit above 0.5"
            )
        if self.min_samples < 7:
            raise ValueError(
                f"min_samples is {self.min_samples}; expected 7 or more: "
                "the first and the last three control points do not move"
            )

    @property
    def vertical_vel_mps(self) -> float:
        """Top climb and descent."""
        return self.max_vertical_vel_mps or self.max_vel_mps


_POSITIVE = (
    "max_vel_mps",
    "max_vertical_vel_mps",
    "max_acc_mps2",
    "planning_horizon_m",
    "resolution_m",
    "map_size_m",
    "update_range_m",
    "max_ray_m",
    "pixel_step",
    "control_point_distance_m",
    "time_factor",
    "clearance_m",
    "checked_share",
    "memory",
    "max_iterations",
    "init_tries",
    "fitness_axial",
    "fitness_radial",
    "astar_max_nodes",
    "astar_step",
)

LANDING = EgoParameters(
    # 3 m/s crosses 30 m in ten seconds of the mission's 120; the flight control accelerates
    # by 4 m/s² at most, and the rest is left to it for following.
    max_vel_mps=3.0,
    max_acc_mps2=2.5,
    # WPNAV_SPEED_DN of ArduPilot: faster, a multirotor sinks into its own downwash.
    max_vertical_vel_mps=1.5,
    # Braking from 3 m/s takes 1.2 s, and the command 0.1 s.
    emergency_time_s=1.5,
    # On a straight global path a tree that happens to stand at the horizon is common.
    target_shift_m=5.0,
    # The marker's estimate moves by centimetres with each frame.
    goal_change_m=0.1,
    max_deviation_m=1.0,
    lookahead_s=0.1,
    # Two cells are the UAV's radius, and ten times upstream's volume takes fewer cells.
    resolution_m=0.25,
    map_size_m=(60.0, 60.0, 14.0),
    # The corner of the view from 10 m is 16 m away; with less, the ground's objects would
    # stay unknown until the UAV is in their reach.
    update_range_m=(20.0, 20.0, 16.0),
    max_ray_m=16.0,
    # Ten times the standard deviation of an RTK height, above leaves and kerbs; a dog's back
    # is at 0.6 m.  The paper's system said 0.5 m, and did not see the dog.
    ground_height_m=0.25,
    ceiling_m=14.0,
    # Feet are 0.2 m below the body: half a metre of air and a quarter for the controller.
    min_height_m=1.0,
    # The UAV's radius of 0.5 m and 0.1 m for position and tracking, rounded up to 0.75 m.
    inflation_m=0.6,
    vertical_inflation_m=0.5,
    # From above, a wall is its top, and nothing tells that one cannot fly into it from the side.
    # It costs the way under trees, where a UAV 1 m wide has no business.
    fill_below=True,
    # At 10 Hz a dog at 5 m/s stays in a cell for a frame or two: one hit occupies, and one or
    # two misses clear.  Upstream's six hits would take 0.6 s, and see no moving thing at all.
    p_hit=0.97,
    # Where a passer-by was last seen is no obstacle for ever; a tree seen for a second is.
    forget_after_s=5.0,
    static_after_s=1.0,
    # Under the UAV's belly.
    camera_offset_m=(0.0, 0.0, -0.05),
    control_point_distance_m=0.5,
    # A guide need not be the shortest, it shows the side to pass on; and obstacles, grown by
    # two cells and more, do not slip between nodes two cells apart.
    astar_step=2,
    astar_weight=1.2,
)
"""For landing systems: a UAV 1 m wide that sees only what is below it, at 10 Hz and 320x240."""
