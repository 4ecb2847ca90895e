"""The file of a film: checked before anything is flown or drawn, written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from pytest_garl.errors import GarlError
from pytest_garl.messages import shown
from pytest_garl.reports.film.drawing import Image
from pytest_garl.reports.film.encoder import find_ffmpeg, write
from pytest_garl.reports.film.gif import write_gif

SUFFIXES = (".mp4", ".gif")


def check_film_file(path: Path, *, makes_folder: bool = False) -> None:
    """Raise GarlError unless a film can be written there: suffix, folder, and an encoder.

    ``makes_folder`` accepts a folder that does not exist.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise GarlError(
            f"{path}: found the suffix {shown(path.suffix)}, expected {' or '.join(SUFFIXES)}; "
            f"name the film {path.with_suffix('.mp4').name if path.name else 'film.mp4'}"
        )
    folder = path.parent
    if not folder.is_dir() and (folder.exists() or not makes_folder):
        what = "a file" if folder.exists() else "nothing"
        raise GarlError(
            f"{path}: found {what} at {folder}, expected a folder for the film; make it, or name "
            "another one"
        )
    if path.is_dir():
        raise GarlError(f"{path}: found a folder, expected a file to write; name another one")
    if folder.is_dir() and not os.access(folder, os.W_OK | os.X_OK):
        raise GarlError(f"{path}: the folder {folder} may not be written; name another one")
    find_ffmpeg()


def write_film(frames: Iterable[Image], path: Path, rate_hz: float) -> None:
    """Write pictures as an .mp4, or as a small GIF if the file's name says so."""
    if path.suffix.lower() == ".gif":
        write_gif(frames, path, rate_hz)
    else:
        write(frames, path, rate_hz)
