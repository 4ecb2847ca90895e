"""The encoder writes what browsers play, and explains what it cannot write."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import imageio_ffmpeg
import numpy as np
import pytest

from pytest_garl.errors import GarlError
from pytest_garl.reports.film import save_video, write
from pytest_garl.reports.film.drawing import Image
from pytest_garl.reports.film.encoder import find_ffmpeg
from pytest_garl.scenarios.placed import Placed
from tests.support.ffmpeg import LISTS, an_ffmpeg
from tests.support.videos import FLOWN_S, LAWN, SCENARIO, Hovers, Video


def test_browsers_play_the_file_at_the_flights_own_speed(video: Video, tmp_path: Path) -> None:
    path = tmp_path / "new" / "flight.mp4"
    save_video(
        path, video.flight, Placed(SCENARIO, LAWN), Hovers.airframe.camera, "II:lost:descent"
    )
    assert list(path.parent.iterdir()) == [path]
    meta = described(path)
    assert (meta["codec"], meta["size"], meta["fps"]) == ("h264", (1024, 656), 10.0)
    assert meta["pix_fmt"].startswith("yuv420p")
    assert meta["duration"] == pytest.approx(FLOWN_S + 2.0, abs=0.05)
    content = path.read_bytes()
    assert content.index(b"moov") < content.index(b"mdat"), "plays only when wholly loaded"
    assert len(content) < 3e6 / 60 * meta["duration"]
    shown = list(decoded(path))
    assert len(shown) == len(video.pictures)
    for index in (0, 10, 29, 40):
        assert np.abs(shown[index].astype(int) - video.pictures[index]).mean() < 6
    assert np.abs(shown[5].astype(int) - shown[25]).mean() > 1


def described(path: Path) -> dict[str, Any]:
    reader = imageio_ffmpeg.read_frames(path)
    meta: dict[str, Any] = next(reader)
    reader.close()
    return meta


def decoded(path: Path) -> Iterator[Image]:
    video = cv2.VideoCapture(str(path))
    while True:
        there, picture = video.read()
        if not there:
            break
        yield np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), np.uint8)
    video.release()


def test_the_ffmpeg_on_path_comes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    on_path = an_ffmpeg(tmp_path / "bin", LISTS)
    monkeypatch.setenv("PATH", str(on_path.parent), prepend=":")
    assert find_ffmpeg() == str(on_path)


@pytest.mark.parametrize(
    "lines", [['echo " V....D mpeg4  MPEG-4"'], ["exit 3"]], ids=["no-libx264", "ends-at-once"]
)
def test_an_ffmpeg_that_cannot_encode_is_passed_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: list[str]
) -> None:
    on_path = an_ffmpeg(tmp_path / "bin", *lines)
    monkeypatch.setenv("PATH", str(on_path.parent), prepend=":")
    assert find_ffmpeg() == imageio_ffmpeg.get_ffmpeg_exe()
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(
        GarlError, match=f"libx264: {on_path} .*; the package imageio-ffmpeg is not"
    ):
        find_ffmpeg()


def test_without_an_encoder_the_error_says_what_was_looked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    words = (
        r"there is no ffmpeg on PATH; the package imageio-ffmpeg is not installed. Install ffmpeg, "
        r"or: pip install 'pytest-garl\[video\]'"
    )
    with pytest.raises(GarlError, match=words):
        write([np.zeros((16, 16, 3), np.uint8)], tmp_path / "a.mp4", 10.0)


def test_an_encoder_that_fails_is_quoted_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = an_ffmpeg(tmp_path / "bin", LISTS, "echo 'Unknown encoder' >&2", "exit 3")
    monkeypatch.setenv("PATH", str(broken.parent), prepend=":")
    pictures = [np.zeros((656, 1024, 3), np.uint8)] * 5
    with pytest.raises(GarlError, match=r"exit status 3\): Unknown encoder"):
        write(pictures, tmp_path / "videos" / "a.mp4", 10.0)
    assert not list((tmp_path / "videos").iterdir())


@pytest.mark.parametrize(
    ("shapes", "words"),
    [
        ([], "at least one picture"),
        ([(15, 16, 3)], "16x15 pixels"),
        ([(16, 16, 3), (16, 32, 3)], "a video has one size"),
    ],
)
def test_pictures_that_make_no_video_are_refused(
    tmp_path: Path, shapes: list[tuple[int, ...]], words: str
) -> None:
    with pytest.raises(GarlError, match=words):
        write((np.zeros(shape, np.uint8) for shape in shapes), tmp_path / "a.mp4", 10.0)
    assert not list(tmp_path.iterdir())
