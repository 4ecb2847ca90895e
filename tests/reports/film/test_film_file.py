"""The file of a film is checked before work is done for it, and a GIF is small and endless."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image as Pillow

from pytest_garl.errors import GarlError
from pytest_garl.reports.film import frames, gif, save_video
from pytest_garl.reports.film.drawing import Image
from pytest_garl.reports.film.film_file import check_film_file, write_film
from pytest_garl.scenarios.placed import Placed
from tests.support.ffmpeg import an_ffmpeg
from tests.support.videos import FLOWN_S, LAWN, SCENARIO, Hovers, Video


def test_a_gif_is_half_as_large_and_plays_again_and_again(video: Video, tmp_path: Path) -> None:
    path = tmp_path / "flight.gif"
    save_video(path, video.flight, Placed(SCENARIO, LAWN), Hovers.airframe.camera)
    assert list(tmp_path.iterdir()) == [path]
    with Pillow.open(path) as shown:
        assert shown.format == "GIF"
        assert (shown.size, shown.info["loop"]) == ((512, 328), 0)
        assert getattr(shown, "n_frames", 0) <= (FLOWN_S + 2.0) * gif.RATE_HZ
        duration_s = sum(_durations_ms(shown)) / 1000
        shown.seek(3)
        small = np.asarray(shown.convert("RGB").resize((1024, 656)), float)
    assert duration_s == pytest.approx(FLOWN_S + 2.0, abs=0.21)
    assert np.abs(small - video.pictures[6]).mean() < 12
    assert path.stat().st_size < 700_000


def _durations_ms(shown: Pillow.Image) -> Iterator[float]:
    for index in range(getattr(shown, "n_frames", 1)):
        shown.seek(index)
        yield float(shown.info["duration"])


def test_the_last_seconds_are_the_end_of_the_whole_film(video: Video) -> None:
    camera = Hovers.airframe.camera
    whole = video.pictures
    last = list(frames(video.flight, Placed(SCENARIO, LAWN), camera, "II:lost:descent", last_s=1.0))
    assert 1.0 * 10 + 20 <= len(last) <= 1.0 * 10 + 21
    assert (last[-1] == whole[-1]).all()
    assert (last[0][:480, :640] == whole[-len(last)][:480, :640]).mean() > 0.9


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("a.avi", r"found the suffix '\.avi', expected \.mp4 or \.gif; name the film a\.mp4"),
        ("a", r"found the suffix '', expected \.mp4 or \.gif; name the film a\.mp4"),
        ("nowhere/a.mp4", "found nothing at .*nowhere, expected a folder for the film; make it"),
        ("file/a.gif", "found a file at .*file, expected a folder"),
        ("folder.mp4", "found a folder, expected a file to write"),
    ],
)
def test_a_name_that_no_film_can_have_is_refused(tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / "folder.mp4").mkdir()
    (tmp_path / "file").touch()
    with pytest.raises(GarlError, match=words):
        check_film_file(tmp_path / name)


def test_a_folder_that_will_be_made_may_be_missing(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    check_film_file(tmp_path / "new" / "a.mp4", makes_folder=True)
    with pytest.raises(GarlError, match="found a file at"):
        check_film_file(tmp_path / "file" / "a.mp4", makes_folder=True)


def test_an_ffmpeg_that_writes_no_gif_is_quoted_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = imageio_ffmpeg.get_ffmpeg_exe()
    gives_up = 'case "$*" in *palettegen*) echo "No filter" >&2; exit 3;; esac'
    broken = an_ffmpeg(tmp_path / "bin", gives_up, f'exec {real} "$@"')
    monkeypatch.setenv("PATH", str(broken.parent), prepend=":")
    path = tmp_path / "films" / "a.gif"
    path.parent.mkdir()
    with pytest.raises(GarlError, match=r"exit status 3\): No filter"):
        write_film([np.zeros((656, 1024, 3), np.uint8)] * 5, path, 10.0)
    assert not list(path.parent.iterdir())


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
def test_a_film_that_is_interrupted_leaves_the_earlier_one(tmp_path: Path, name: str) -> None:
    def interrupted() -> Iterator[Image]:
        yield np.zeros((64, 64, 3), np.uint8)
        raise KeyboardInterrupt

    path = tmp_path / name
    path.write_text("earlier")
    with pytest.raises(KeyboardInterrupt):
        write_film(interrupted(), path, 10.0)
    assert path.read_text() == "earlier"
    assert list(tmp_path.iterdir()) == [path]


def test_a_gif_has_no_more_pictures_than_the_video(tmp_path: Path) -> None:
    path = tmp_path / "a.gif"
    pictures = [np.full((64, 64, 3), 25 * n, np.uint8) for n in range(10)]
    write_film(pictures, path, gif.RATE_HZ / 2)
    with Pillow.open(path) as shown:
        assert getattr(shown, "n_frames", 0) == 10
