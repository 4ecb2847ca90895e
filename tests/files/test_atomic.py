from __future__ import annotations

import multiprocessing
import threading
import time
from pathlib import Path

import pytest

from pytest_garl.errors import SavingError
from pytest_garl.files.atomic import check_writable, locked, write_text_atomically


def add_one(path: Path) -> None:
    for _ in range(20):
        with locked(path.parent):
            count = int(path.read_text())
            time.sleep(0.001)
            write_text_atomically(path, str(count + 1))


def test_locked_writers_lose_nothing(tmp_path: Path) -> None:
    path = write_text_atomically(tmp_path / "deep" / "count", "0")
    context = multiprocessing.get_context("spawn")
    processes = [context.Process(target=add_one, args=(path,)) for _ in range(2)]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
    assert path.read_text() == "40"
    assert [each.name for each in path.parent.iterdir()] == ["count"]


def test_who_waits_is_told(tmp_path: Path) -> None:
    told = threading.Event()

    def second() -> None:
        with locked(tmp_path, told.set):
            pass

    with locked(tmp_path, told.set):
        assert not told.is_set()
        thread = threading.Thread(target=second)
        thread.start()
        assert told.wait(60)
    thread.join()


def test_line_ends_stay_as_they_are(tmp_path: Path) -> None:
    assert write_text_atomically(tmp_path / "a", "ü\r\nb\n").read_bytes() == "ü\r\nb\n".encode()


def test_an_unwritable_place_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(SavingError, match=r"file/a.csv: cannot be saved \(.*file"):
        write_text_atomically(tmp_path / "file" / "a.csv", "")
    with (
        pytest.raises(SavingError, match="file: nothing can be saved here"),
        locked(tmp_path / "file"),
    ):
        pass


def test_a_target_is_checked_and_left_as_it_is(tmp_path: Path) -> None:
    check_writable(tmp_path / "new" / "file")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").write_text("earlier")
    check_writable(tmp_path / "file")
    assert (tmp_path / "file").read_text() == "earlier"
    with pytest.raises(SavingError, match=r"cannot be written \(Not a directory\)"):
        check_writable(tmp_path / "file" / "below")
    with pytest.raises(SavingError, match="found a folder, expected the name of a file"):
        check_writable(tmp_path)
