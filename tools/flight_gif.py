"""Draw the last seconds of a saved case as a small GIF, such as the one in the README.

``python -m tools.flight_gif CASE docs/pictures/flight.gif`` flies the case first.  The pictures
are those of ``--video``: the camera's view and the height on the left, the map on the right.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from pytest_garl.landing_system import airframe_of
from pytest_garl.regressions.case_file import load_case
from pytest_garl.regressions.replay import replay, system_of
from pytest_garl.video import drawing, frames, rate_hz
from pytest_garl.video.camera_pane import HEIGHT, WIDTH

WIDTH_PX = 600
PALETTE_COLOURS = 24
"""Number of palette colours besides the fixed colours of the drawing."""
HOLD_MS = 3000
"""How long the last picture, which shows the outcome, is shown."""
FIXED_COLOURS = (
    drawing.BACKGROUND,
    drawing.INK,
    drawing.FAINT,
    drawing.UAV,
    drawing.VIEW,
    drawing.MARKER,
    drawing.SYSTEM,
    drawing.HIT,
    drawing.OBJECTS["person"],
)


def shrink(picture: drawing.Image) -> Image.Image:
    """Return a picture of the video in the GIF's size, its camera view without sensor noise."""
    denoised = picture.copy()
    view = denoised[:HEIGHT, :WIDTH]
    view[:] = cv2.bilateralFilter(cv2.medianBlur(view, 5), 9, 40, 9)
    height = round(WIDTH_PX * picture.shape[0] / picture.shape[1])
    return Image.fromarray(cv2.resize(denoised, (WIDTH_PX, height), interpolation=cv2.INTER_AREA))


def palette_of(pictures: list[Image.Image]) -> Image.Image:
    """Return one palette for all pictures, so that an unchanged background takes no bytes."""
    sheet = Image.fromarray(np.vstack([np.asarray(each) for each in pictures]))
    found = sheet.quantize(PALETTE_COLOURS, method=Image.Quantize.MEDIANCUT).getpalette() or []
    fixed = [value for colour in FIXED_COLOURS for value in colour]
    palette = Image.new("P", (1, 1))
    palette.putpalette(fixed + found[: 3 * PALETTE_COLOURS])
    return palette


def save(pictures: list[Image.Image], path: Path, spacing_s: float) -> None:
    """Write pictures as an endless GIF."""
    palette = palette_of(pictures)
    indexed = [each.quantize(palette=palette, dither=Image.Dither.NONE) for each in pictures]
    durations = [round(1000 * spacing_s)] * (len(indexed) - 1) + [HOLD_MS]
    indexed[0].save(
        path, save_all=True, append_images=indexed[1:], duration=durations, loop=0, optimize=True
    )


def main() -> None:
    """Fly a case and write its GIF."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("case", type=Path)
    parser.add_argument("gif", type=Path)
    parser.add_argument("--seconds", type=float, default=9.8, help="how much of the end is shown")
    parser.add_argument("--spacing", type=float, default=0.7, help="seconds between pictures")
    arguments = parser.parse_args()
    case = load_case(arguments.case)
    result = replay(case, Path.cwd())
    if result.flight is None:
        parser.error(f"{arguments.case}: the flight was not recorded")
    camera = airframe_of(system_of(case, Path.cwd())).camera
    video = list(frames(result.flight, case.scenario, result.map, camera, result.signature))
    rate = rate_hz(result.flight, camera)
    end = len(result.flight.steps)
    first = max(0, end - round(arguments.seconds * rate))
    shown = [*video[first : end - 1 : round(arguments.spacing * rate)], video[-1]]
    save([shrink(each) for each in shown], arguments.gif, arguments.spacing)
    print(f"{arguments.gif}: {len(shown)} pictures, {arguments.gif.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
