"""Picture of the camera group: what a camera shows that is not as declared."""

from __future__ import annotations

from pathlib import Path

from pytest_garl.landing_system import Camera
from pytest_garl.simulation.camera.exposure import Movement
from pytest_garl.simulation.camera.projection import eye_under
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.camera.true_camera import Mounting, true_camera
from pytest_garl.simulation.randomness import generator
from tests.support.flights import EMPTY, nominal

LEVEL = (0.0, 0.0, 0.0, 1.0)
CASES = {
    "as declared": {},
    "roll 10 degrees": {"camera__mounting_roll_deg": 10.0},
    "pitch 10 degrees": {"camera__mounting_pitch_deg": 10.0},
    "yaw 10 degrees": {"camera__mounting_yaw_deg": 10.0},
    "focal length + 20 %": {"camera__calibration_error_percent": 20.0},
    "33 ms, turning at 57 degrees/s": {"camera__exposure_ms": 33.0},
    "dirt 20 %": {"camera__dirt_percent": 20.0},
}
TURNING = Movement(velocity_mps=(1.0, 0.0, 0.0), spin_radps=(0.0, 1.0, 0.0))


def draw(folder: Path) -> None:
    """Draw ``camera.png``."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, 4, figsize=(9.6, 4.0), constrained_layout=True)
    for axis, (title, values) in zip(axes.flat, CASES.items(), strict=False):
        scenario = nominal(**values)
        camera = true_camera(Camera(), scenario)
        renderer = Renderer(scenario, EMPTY, camera, generator(scenario.seed, "sensor"))
        place = (renderer.marker_m[0], renderer.marker_m[1], 6.0)
        attitude = Mounting(scenario).attitude(LEVEL)
        frame = renderer.render(eye_under(place, LEVEL), attitude, 0.0, [], TURNING)
        axis.imshow(frame.image)
        axis.set_title(title, fontsize="small")
        axis.set(xticks=[], yticks=[])
    axes.flat[-1].set_axis_off()
    figure.savefig(folder / "camera.png", dpi=60)
    pyplot.close(figure)
