"""Draw the last seconds of a recorded flight, beside the description of its verdict.

``python -m lab.pictures.flight_sheet court-g03-s17`` writes ``.garl/court-g03-s17.png``: above what
the camera saw, below the same moments from the side with the UAV as a circle.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.execution.ledger import Ledger
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import load
from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.simulation.camera.projection import View
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.randomness import generator
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import Limits

MOMENTS = 6
_BESIDE_M = 5.0
Image = NDArray[np.uint8]


def sheet(flight: Flight, renderer: Renderer, spacing_s: float) -> Image:
    """Return the last moments, one a column, fewer where a flight was short."""
    columns = []
    moments = (flight.elapsed_s - back * spacing_s for back in reversed(range(MOMENTS)))
    for when in (each for each in moments if each >= 0):
        row = int(np.argmin(np.abs(flight.uav.time_s - when)))
        x, y, z = (float(value) for value in flight.uav.position_m[row])
        a, b, c, d = (float(value) for value in flight.uav.attitude[row])
        objects = []
        for item in flight.objects:
            at, turn = item.track.position_m[row], item.track.attitude[row]
            place = (float(at[0]), float(at[1]), float(at[2]))
            objects.append((place, 2 * math.atan2(float(turn[2]), float(turn[3]))))
        below = renderer.render((x, y, max(0.06, z - 0.05)), (a, b, c, d), when, objects).image
        # From the west, looking east and a little down.
        eye, tilt = (x - _BESIDE_M, y, z + 1.5), -1.25
        q = (0.0, math.sin(tilt / 2), 0.0, math.cos(tilt / 2))
        side = renderer.render(eye, q, when, objects).image
        view = View.of(renderer.camera, eye, q)
        u, v = view.pixels(((np.array([[x, y, z]]) - view.eye) @ view.axes.T).astype(float))[0]
        cv2.circle(side, (int(u), int(v)), 14, (255, 40, 255), 1)
        step = min(flight.steps, key=lambda each: abs(each.time_s - when))
        phase = step.diagnostics.phase if step.diagnostics else ""
        text = f"{when:.1f} s {max(0.0, z - 0.2):.1f} m {phase}"
        cv2.putText(below, text, (4, 14), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (255, 255, 0))
        columns.append(np.vstack([below, side]))
    return np.asarray(np.hstack(columns), np.uint8)


def main() -> None:
    """Write one picture per system that flew the slot."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("slot", help="as in the summary, for instance court-g03-s17")
    parser.add_argument("--garl-dir", type=Path, default=Path(".garl"))
    parser.add_argument("--spacing", type=float, default=0.5, help="seconds between pictures")
    arguments = parser.parse_args()
    name, generation, index = arguments.slot.rsplit("-", 2)
    ledger = Ledger(arguments.garl_dir / "ledger.sqlite")
    scenarios = ledger.queries.scenarios(int(generation[1:]), int(index[1:]), name)
    flights = arguments.garl_dir / "flights"
    paths = sorted(flights.glob(f"*-{arguments.slot}.npz"))
    if not paths:
        parser.error(
            f"there is no record of {arguments.slot} in {flights}, where those of violations are "
            f"kept, but not after an experiment; fly it again: pytest FILE "
            f"--garl-repeat={arguments.slot} -o garl_dir={arguments.garl_dir}"
        )
    for path in paths:
        flight = load(path)
        scenario = next(iter(scenarios.values()))
        map = load_map(name)
        renderer = Renderer(Placed(scenario, map), Camera(), generator(scenario.seed, "sensor"))
        target = arguments.garl_dir / f"{path.stem}.png"
        picture = sheet(flight, renderer, arguments.spacing)
        cv2.imwrite(str(target), cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
        verdict = judge(flight, Limits())
        print(f"{target}: {verdict.signature or verdict.outcome}: {verdict.story}")


if __name__ == "__main__":
    main()
