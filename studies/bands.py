"""Where detection fails: the share of frames read over each condition of weather and light alone.

``python -m studies.bands`` draws what ``docs/bands.csv`` lacks: frames from straight above the
marker, one condition at a value and everything else nominal, each frame with another place and
heading, on both maps.  Weather is seen from 10 m, the height of a search, and light from 5 m too.
Two detectors read each frame: OpenCV's ArUco with its default parameters, and the network of
TPHYolo-MLS.  ``--report`` writes the table into docs/weather.md.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import math
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from pytest_garl import cpu_dispatch
from pytest_garl.landing_system import Observation
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.domains.domain import ELEVATION
from pytest_garl.scenarios.domains.reader import domain_named
from pytest_garl.scenarios.genes import SUN, genome_for
from pytest_garl.scenarios.light import position_of_elevation
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.units import WEATHER_GENES, WEATHER_UNITS
from pytest_garl.scenarios.validity import repair
from pytest_garl.simulation.camera.projection import eye_under
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.randomness import generator
from studies.detectability_frames import CAMERA, DETECTORS, Detectors, DrawnFrame, attitude_of
from studies.table import Key, ResultTable, Row, run_study

SEED = 28
SEARCH_M, LOW_M = 10.0, 5.0
VALUES: dict[str, tuple[float, ...]] = {
    ELEVATION: (60, 5, 2, 0, -1, -1.5, -2, -2.5, -2.7, -3, -3.2, -3.5, -4),
    "weather.dust_visibility_m": (133, 50, 30, 20),
    "weather.fog_visibility_m": (66, 30, 20, 17, 15, 13, 12, 11, 10),
    "weather.rain_mmph": (15, 50, 100),
    "weather.snow_mmph": (1.5, 3, 5, 10),
    "weather.wetness_percent": (15, 50, 100),
    "weather.falling_leaves_per_m3": (0.3, 0.6, 1, 1.5, 2),
    "weather.leaf_cover_percent": (5, 15, 30, 45, 60, 70, 75, 80),
    "weather.snow_cover_percent": (5, 10, 15, 20, 30, 40, 45, 50, 60),
}
"""What is measured: towards the end of what the simulator can draw."""
DOCS = Path(__file__).parents[1] / "docs"
TABLE = ResultTable(
    file=DOCS / "bands.csv",
    columns=("condition", "value", "height_m", "frames", "stock", "learned"),
    key=("condition", "value", "height_m", "frames"),
)
BEGIN = "<!-- shares of frames read: python -m studies.bands --report -->\n"
END = "<!-- end of the shares -->\n"


@functools.cache
def _map(name: str) -> Map:
    return dataclasses.replace(load_map(name), objects=())


@functools.cache
def _detectors() -> Detectors:
    return Detectors()


def scenario_of(condition: str, value: float, number: int) -> Scenario:
    """Return the scenario of a frame: one condition at a value, everything else nominal."""
    map = _map(("court", "lawn")[number % 2])
    genome = genome_for(map)
    rng = np.random.default_rng([SEED, number])
    x, y = (float(each) for each in rng.uniform(-1, 1, 2))
    if condition == ELEVATION:
        key, gene = SUN, position_of_elevation(value)
    else:
        key = WEATHER_GENES[condition.partition(".")[2]]
        gene = WEATHER_UNITS[key].gene(value)
    nominal = np.array(genome.nominal, float)
    scenario = decode(nominal, genome, map=map.name, seed=int(rng.integers(2**31)))
    return repair(scenario.replace({"marker.x": x, "marker.y": y, key: gene}), map)


def frame_of(scenario: Scenario, height_m: float, rng: np.random.Generator) -> DrawnFrame:
    """Return the frame from straight above the marker, at a random heading and time."""
    renderer = Renderer(scenario, _map(scenario.map), CAMERA, generator(scenario.seed, "sensor"))
    position = (*renderer.marker_m[:2], height_m)
    attitude = attitude_of(0.0, 0.0, float(rng.uniform(0, 2 * math.pi)))
    frame = renderer.render(eye_under(position, attitude), attitude, float(rng.uniform(0, 60)), [])
    assert frame.marker is not None  # the marker is in the middle
    observation = Observation(
        time_s=0.0,
        position_m=np.array(position),
        velocity_mps=np.zeros(3),
        attitude=np.array(attitude),
        image=frame.image,
        depth_m=frame.depth_m,
    )
    return DrawnFrame(
        image=frame.image,
        observation=observation,
        marker_m=renderer.marker_m,
        view=frame.marker,
    )


def row_of(key: Key) -> dict[str, Any]:
    """Return a row of the table: the frames that each detector reads."""
    condition, value, height_m, frames = key
    reads = np.zeros(len(DETECTORS), int)
    for number in range(int(frames)):
        scenario = scenario_of(condition, float(value), number)
        rng = np.random.default_rng([SEED, number, 1])
        reads += _detectors().read(frame_of(scenario, float(height_m), rng))
    counts = dict(zip(DETECTORS, reads.tolist(), strict=True))
    return {
        **dict(zip(TABLE.key, key, strict=True)),
        "stock": counts["stock"],
        "learned": counts["learned"],
    }


def keys(frames: int) -> list[Key]:
    """Return the keys of the whole table."""
    return [
        (condition, f"{value:g}", f"{height:g}", str(frames))
        for condition, values in VALUES.items()
        for height in ((LOW_M, SEARCH_M) if condition == ELEVATION else (SEARCH_M,))
        for value in values
    ]


def report(rows: Iterable[Row]) -> str:
    """Return the table in Markdown: for each value the shares that both detectors read."""
    ends = {key: (low, high) for key, low, high in domain_named("field").ranges}
    cells: dict[tuple[str, str], list[str]] = {}
    for row in rows:
        count = int(row["frames"])
        stock, learned = (int(row[name]) / count for name in ("stock", "learned"))
        text = f"{float(row['value']):g}: {stock:.2f}, {learned:.2f}"
        cells.setdefault((row["condition"], row["height_m"]), []).append(text)
    lines = [
        "| condition | from | value: share read by stock ArUco, by the network | `field` ends at |",
        "| --- | --- | --- | --- |",
    ]
    for (condition, height), texts in cells.items():
        low, high = ends[condition]
        visibility = "visibility" in condition or condition == ELEVATION
        end = low if visibility else high
        lines.append(f"| `{condition}` | {height} m | {'; '.join(texts)} | {end:g} |")
    return "\n".join(lines)


def with_table(page: str, table: str) -> str:
    """Return the page with the table between its two marks."""
    head, begin, rest = page.partition(BEGIN)
    _, end, tail = rest.partition(END)
    if not begin or not end:
        raise SystemExit(f"docs/weather.md: found no lines {BEGIN!r} and {END!r}")
    return f"{head}{begin}\n{table}\n\n{end}{tail}"


def write_report(rows: list[Row]) -> str:
    """Write the table into its page and return it."""
    page, table = DOCS / "weather.md", report(rows)
    page.write_text(with_table(page.read_text(), table))
    return table


def draw_all(arguments: argparse.Namespace) -> None:
    """Draw and read what the table lacks."""
    known = TABLE.keys()
    missing = [key for key in keys(arguments.frames) if key not in known]
    cpu_dispatch.pin()
    with ProcessPoolExecutor(arguments.workers, mp_context=get_context("spawn")) as pool:
        for done, row in enumerate(pool.map(row_of, missing), start=1):
            print(f"{done} of {len(missing)}: ", end="")
            TABLE.append([row])


def main() -> None:
    """Draw or report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=100, help="of each value (default 100)")
    parser.add_argument("--workers", type=int, default=2)
    run_study(parser, TABLE, write_report, draw_all)


if __name__ == "__main__":
    main()
