"""Writes pictures as a small GIF that plays again and again."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from pathlib import Path

import cv2
import numpy as np

from pytest_garl.errors import GarlError
from pytest_garl.reports.film import camera_pane
from pytest_garl.reports.film.drawing import Image
from pytest_garl.reports.film.encoder import encode, find_ffmpeg, no_picture, run_command

RATE_HZ = 5.0
"""A second of a moving camera takes 0.14 MB at this rate, and twice as much at 10 Hz: measured on
the last 6 s of two landings in clear weather."""
COLOURS = 64
"""On the same flights 48 make the file a tenth smaller, and the marks on the map pale."""


def write_gif(frames: Iterable[Image], path: Path, rate_hz: float) -> None:
    """Write pictures, RGB uint8 (H, W, 3) of one size, as a GIF of half their size.

    The file appears once it is complete.  Raises GarlError as ``encoder.write`` does.
    """
    ffmpeg = find_ffmpeg()
    shown_hz = min(RATE_HZ, rate_hz)
    pictures = map(_small, _thinned(frames, rate_hz, shown_hz))
    first = next(pictures, None)
    if first is None:
        raise no_picture(path)
    size = f"{first.shape[1]}x{first.shape[0]}"
    scratch = path.with_name(f".{path.name}.{os.getpid()}")
    with tempfile.TemporaryDirectory(prefix="garl-film-") as folder:
        exact, palette = str(Path(folder, "film.nut")), str(Path(folder, "palette.png"))
        start = [ffmpeg, "-nostdin", "-y", "-v", "error"]
        source = f"-f rawvideo -pix_fmt rgb24 -s {size} -r {shown_hz:g} -i - -c:v ffv1"
        encode([*start, *source.split(), exact], chain([first], pictures), path)
        try:
            # A palette of the whole film: with one for each picture the ground would flicker.
            chosen = f"-vf palettegen=max_colors={COLOURS} -update 1 -frames:v 1"
            _run([*start, "-i", exact, *chosen.split(), palette], path)
            drawn = "-lavfi paletteuse=dither=none:diff_mode=rectangle -loop 0 -f gif"
            _run([*start, "-i", exact, "-i", palette, *drawn.split(), str(scratch)], path)
            scratch.replace(path)
        finally:
            scratch.unlink(missing_ok=True)


def _thinned(frames: Iterable[Image], rate_hz: float, shown_hz: float) -> Iterator[Image]:
    """Yield as many of the pictures as a lower rate shows, the first among them."""
    shown = 0
    for index, picture in enumerate(frames):
        if index * shown_hz / rate_hz >= shown - 1e-6:
            shown += 1
            yield picture


def _small(picture: Image) -> Image:
    """Return a picture of half the size, whose camera view has no sensor noise.

    Noise changes from frame to frame, and would be a fifth of the file.
    """
    calm = picture.copy()
    view = calm[: camera_pane.HEIGHT, : camera_pane.WIDTH]
    view[:] = cv2.bilateralFilter(view, 9, 60, 9)
    half = (picture.shape[1] // 2, picture.shape[0] // 2)
    return np.asarray(cv2.resize(calm, half, interpolation=cv2.INTER_AREA), np.uint8)


def _run(command: Sequence[str], path: Path) -> None:
    done = run_command(command)
    if done.returncode:
        raise GarlError(
            f"{path}: the encoder {command[0]} gave up (exit status {done.returncode}): "
            f"{done.stderr.strip()}. Is there space, and may the folder be written?"
        )
