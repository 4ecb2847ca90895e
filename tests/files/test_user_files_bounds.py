from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from pytest_garl.errors import PolicyError, ScenarioError
from pytest_garl.files.user_files import read_bytes, read_text


def test_a_file_is_read_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"one\r\ntwo \xc3\xa4")
    assert read_bytes(tmp_path / "a") == b"one\r\ntwo \xc3\xa4"
    assert read_text(tmp_path / "a") == "one\r\ntwo ä"


def test_the_limit_is_exact(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"x" * 100)
    assert len(read_bytes(tmp_path / "a", limit=100)) == 100
    with pytest.raises(ScenarioError, match=r"/a: found 100 bytes, expected at most 99$"):
        read_bytes(tmp_path / "a", limit=99)


def test_a_large_file_is_refused_before_it_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with (tmp_path / "big").open("wb") as file:
        file.truncate(10**12)
    monkeypatch.setattr(os, "open", None)
    with pytest.raises(ScenarioError, match=r"/big: found 1000000000000 bytes, expected at"):
        read_bytes(tmp_path / "big")


def test_a_file_that_says_it_is_empty_is_read_no_further_than_the_limit() -> None:
    maps = Path("/proc/self/maps")
    assert maps.stat().st_size == 0
    with pytest.raises(ScenarioError, match="maps: found more than 10 bytes, expected at most 10"):
        read_bytes(maps, limit=10)


def _link(path: Path) -> None:
    path.symlink_to("/dev/zero")


def _loop(path: Path) -> None:
    path.symlink_to(path)


def _dangling(path: Path) -> None:
    path.symlink_to(path.with_name("nothing"))


def _socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(path))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (_link, "found a device, expected a regular file"),
        (os.mkfifo, "found a pipe, expected a regular file"),
        (Path.mkdir, "found a folder, expected a regular file"),
        (_socket, "found a socket, expected a regular file"),
        (_loop, "cannot be read: Too many levels of symbolic links"),
        (_dangling, "cannot be read: No such file or directory"),
    ],
)
def test_only_regular_files_are_read(tmp_path: Path, make: object, words: str) -> None:
    path = tmp_path / "case.toml"
    assert callable(make)
    make(path)
    with pytest.raises(ScenarioError, match=words) as caught:
        read_text(path)
    assert str(path) in str(caught.value)


def test_the_error_is_of_the_wanted_kind_and_ends_with_the_hint(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"\xff")
    with pytest.raises(PolicyError, match=r"; expected a manifest$"):
        read_text(tmp_path / "a", error=PolicyError, hint="; expected a manifest")
    with pytest.raises(PolicyError, match="embedded null"):
        read_text(Path("a\0b"), error=PolicyError)
