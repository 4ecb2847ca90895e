"""The sensors of one flight: what the camera shows, and when the landing system gets it."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from pytest_garl.landing_system import Camera, Observation
from pytest_garl.scenarios.bodies import rotate
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.camera.cover_event import renderer_of
from pytest_garl.simulation.camera.depth_sensor import DepthSensor
from pytest_garl.simulation.camera.exposure import Movement
from pytest_garl.simulation.camera.frame import Frame, blank_frame
from pytest_garl.simulation.camera.projection import eye_under
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.camera.true_camera import Mounting, true_camera
from pytest_garl.simulation.events import Event, Moments
from pytest_garl.simulation.physics.npc import Npc
from pytest_garl.simulation.physics.vehicle import Motion, Vector
from pytest_garl.simulation.physics.world import PHYSICS_RATE_HZ
from pytest_garl.simulation.randomness import generator
from pytest_garl.simulation.rangefinder import Ranging
from pytest_garl.simulation.recorder import FrameContent, Recorder
from pytest_garl.simulation.system_under_test.observation import observe
from pytest_garl.simulation.timing import Timing


@dataclass(frozen=True, slots=True, kw_only=True)
class Delivery:
    """An observation as it reaches the landing system.

    ``content`` is what the picture shows, and ``place_m`` is where the UAV was at that moment.
    ``range_m`` is the rangefinder's reading; the observation notes whether somebody reads it.
    """

    observation: Observation
    content: FrameContent
    place_m: Vector
    range_m: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Picture:
    frame: Frame
    content: FrameContent
    place_m: Vector
    tick: int
    jitter_ms: float
    range_m: float | None


class Sensors:
    """Takes pictures, adds a pose to each, and delivers them in order, each when it is due."""

    def __init__(
        self,
        scenario: Scenario,
        camera: Camera,
        recorder: Recorder,
        npcs: Sequence[Npc],
        ranging: Ranging,
        moments: Moments,
    ) -> None:
        self._camera, self._recorder, self._npcs = camera, recorder, npcs
        self._ranging, self._moments = ranging, moments
        self._timing, self._mounting = Timing(scenario, moments), Mounting(scenario)
        self._outage = Event(scenario, "outage", moments)
        self._freezes = scenario["outage.frozen"] > 0
        self._rng = generator(scenario.seed, "pose")
        self._renderer: Renderer | None = None
        self._depth: DepthSensor | None = None
        self._ticks_per_frame = max(1, round(PHYSICS_RATE_HZ / camera.rate_hz))
        self._last_look: tuple[Frame, FrameContent] | None = None
        self._pictures: deque[_Picture] = deque()
        self._poses: deque[Motion] = deque(maxlen=1 + max(0, -self._timing.stamp_ticks))
        self._under_way: deque[tuple[int, Delivery]] = deque()

    def switch_on(self, placed: Placed) -> None:
        """Switch the camera on; until then frames are black and show nothing."""
        camera = true_camera(self._camera, placed.scenario)
        self._renderer = renderer_of(placed, camera, self._moments)
        self._depth = DepthSensor(placed.scenario, camera)

    def change(self, scenario: Scenario) -> None:
        """Show another environment from the next picture on."""
        if self._renderer and self._depth:
            self._renderer.change(scenario)
            self._depth.change(scenario)

    def takes_picture(self, tick: int) -> bool:
        """Whether the camera takes a picture at a step of the physics."""
        return tick % self._ticks_per_frame == 0

    def look(self, tick: int, motion: Motion) -> tuple[Frame, FrameContent]:
        """Return the camera's picture at this moment, and what it shows."""
        now = tick / PHYSICS_RATE_HZ
        black = blank_frame(self._camera.height_px, self._camera.width_px), FrameContent()
        if self._renderer is None or self._depth is None:
            return black
        if self._outage.happens(now):
            return self._last_look or black
        eye = eye_under(motion.position_m, motion.attitude, self._camera.offset_m)
        poses = [(npc.position_m, npc.yaw_rad) for npc in self._npcs]
        attitude = self._mounting.attitude(motion.attitude)
        movement = Movement(
            velocity_mps=motion.velocity_mps,
            spin_radps=rotate(motion.attitude, motion.spin_radps),
        )
        frame = self._renderer.render(eye, attitude, now, poses, movement)
        frame.measured_depth_m = self._depth.measured(frame.depth_m, now)
        content = self._recorder.content_of(frame, self._renderer, eye)
        if self._freezes:
            self._last_look = frame, content
        return frame, content

    def deliveries(self, tick: int, motion: Motion, estimate: Motion) -> Iterator[Delivery]:
        """Yield what reaches the landing system at this step of the physics, in order.

        ``motion`` is the true motion; ``estimate`` is the navigation's estimate of it.
        """
        late = self._timing.stamp_ticks
        if late < 0:
            self._poses.append(estimate)
        if self.takes_picture(tick) and tick + late >= 0:
            self._take(tick, motion)
        if self._pictures and self._pictures[0].tick + max(0, late) <= tick:
            picture = self._pictures.popleft()
            self._send(tick, picture, self._poses[0] if late < 0 else estimate)
        while self._under_way and self._under_way[0][0] <= tick:
            yield self._under_way.popleft()[1]

    def _take(self, tick: int, motion: Motion) -> None:
        """Take a picture that waits for its pose, unless the frame is lost."""
        jitter_ms = self._timing.jitter_ms()
        if jitter_ms is None:
            return
        frame, content = self.look(tick, motion)
        picture = _Picture(
            frame=frame,
            content=content,
            place_m=motion.position_m,
            tick=tick,
            jitter_ms=jitter_ms,
            range_m=self._ranging.reading_m(motion),
        )
        self._pictures.append(picture)

    def _send(self, tick: int, picture: _Picture, pose: Motion) -> None:
        """Add a pose to a picture, and send both to the landing system."""
        observation = observe(
            picture.frame,
            time_s=(tick + min(0, self._timing.stamp_ticks)) / PHYSICS_RATE_HZ,
            position_m=pose.position_m,
            velocity_mps=pose.velocity_mps,
            attitude=pose.attitude,
            rangefinder_m=picture.range_m,
            rng=self._rng,
            noted=self._recorder.data_read,
        )
        delivery = Delivery(
            observation=observation,
            content=picture.content,
            place_m=picture.place_m,
            range_m=picture.range_m,
        )
        self._under_way.append((self._timing.arrival(tick, picture.jitter_ms), delivery))
