"""Writes pictures as an H.264 .mp4 that every browser plays."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from itertools import chain
from pathlib import Path

from pytest_garl.errors import GarlError
from pytest_garl.reports.film.drawing import Image

_QUALITY = 27
"""x264's constant rate factor: letters and one-pixel lines stay clear, sensor noise goes."""
TOP_KBPS = 350
"""Limits a video of 60 s to 2.6 MB in any weather."""
_BUFFER_S = 4
"""The encoder may exceed the limit for this time."""
_PATIENCE_S = 30
"""An ffmpeg lists its encoders in a tenth of a second."""


def write(frames: Iterable[Image], path: Path, rate_hz: float, *, top_kbps: int = TOP_KBPS) -> None:
    """Encode pictures, RGB uint8 (H, W, 3) of one even size, into the .mp4 file ``path``.

    The file appears once it is complete, and has ``top_kbps`` kilobits per second at most over any
    four seconds.  Raises GarlError where there is no encoder, where the pictures do not fit
    together, or with the encoder's own words where it fails.
    """
    ffmpeg = find_ffmpeg()
    pictures = iter(frames)
    first = next(pictures, None)
    if first is None:
        raise no_picture(path)
    height, width = first.shape[:2]
    if height % 2 or width % 2:
        raise GarlError(
            f"{path}: pictures of {width}x{height} pixels; browsers play even widths and heights"
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    scratch = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        command = _command(ffmpeg, width, height, rate_hz, scratch, top_kbps)
        encode(command, chain([first], pictures), path)
        scratch.replace(path)
    finally:
        scratch.unlink(missing_ok=True)


def no_picture(path: Path) -> GarlError:
    """Return the error of a film without any picture."""
    return GarlError(f"{path}: a video needs at least one picture; the flight gave none")


def encode(command: Sequence[str], pictures: Iterable[Image], path: Path) -> None:
    """Let ffmpeg read pictures from its standard input.

    Raises GarlError, which names ``path``, if they differ in size or ffmpeg fails.
    """
    shape = None
    with tempfile.TemporaryFile() as said:
        with subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=said
        ) as encoder:
            try:
                assert encoder.stdin is not None
                # An encoder that has given up closes the pipe; its words say why.
                with contextlib.suppress(BrokenPipeError), encoder.stdin as pipe:
                    for picture in pictures:
                        shape = shape or picture.shape
                        if picture.shape != shape:
                            raise GarlError(
                                f"{path}: a picture of shape {picture.shape} among pictures of "
                                f"{shape}; a video has one size"
                            )
                        pipe.write(picture.tobytes())
            except BaseException:
                encoder.kill()
                raise
        if encoder.returncode:
            said.seek(0)
            words = said.read().decode(errors="replace").strip()
            raise GarlError(
                f"{path}: the encoder {command[0]} gave up (exit status {encoder.returncode}): "
                f"{words}. Is there space, may the folder be written, and does this ffmpeg have "
                "libx264?"
            )


def _command(
    program: str, width: int, height: int, rate_hz: float, path: Path, top_kbps: int
) -> list[str]:
    source = f"-f rawvideo -pix_fmt rgb24 -s {width}x{height} -r {rate_hz:g} -i -"
    coding = f"-c:v libx264 -preset veryfast -crf {_QUALITY} -pix_fmt yuv420p"
    bound = f"-maxrate {top_kbps}k -bufsize {_BUFFER_S * top_kbps}k"
    # Untagged, players guess the colours' matrix from the picture's size.
    colours = "-vf scale=out_color_matrix=bt709,"
    colours += "setparams=color_primaries=bt709:color_trc=bt709:colorspace=bt709"
    words = f"-nostdin -y -v error {source} -an {coding} {bound} {colours} -movflags +faststart"
    return [program, *words.split(), "-f", "mp4", str(path)]


def run_command(
    command: Sequence[str], timeout_s: float | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a command that reads nothing; return its exit status and what it said."""
    return subprocess.run(
        command,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        timeout=timeout_s,
        check=False,
    )


def find_ffmpeg() -> str:
    """Return an ffmpeg that writes H.264: the one on PATH, else that of imageio-ffmpeg.

    Raises GarlError, which says what was found, if there is none.
    """
    found = []
    on_path = shutil.which("ffmpeg")
    if on_path is None:
        found.append("there is no ffmpeg on PATH")
    elif problem := _problem(on_path):
        found.append(problem)
    else:
        return on_path
    try:
        import imageio_ffmpeg

        packaged = str(imageio_ffmpeg.get_ffmpeg_exe())
    except ImportError:
        found.append("the package imageio-ffmpeg is not installed")
    except RuntimeError as error:
        found.append(f"imageio-ffmpeg has no ffmpeg for this machine ({error})")
    else:
        if not (problem := _problem(packaged)):
            return packaged
        found.append(problem)
    raise GarlError(
        f"a video needs an ffmpeg with the encoder libx264: {'; '.join(found)}. Install ffmpeg, "
        "or: pip install 'pytest-garl[video]'"
    )


def _problem(ffmpeg: str) -> str:
    """Return why an ffmpeg cannot encode; empty if it can."""
    command = [ffmpeg, "-nostdin", "-hide_banner", "-encoders"]
    try:
        done = run_command(command, timeout_s=_PATIENCE_S)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"{ffmpeg} cannot be run ({error})"
    if done.returncode:
        return f"{ffmpeg} ended with status {done.returncode} when asked for its encoders"
    return "" if " libx264 " in done.stdout else f"{ffmpeg} has no libx264"
