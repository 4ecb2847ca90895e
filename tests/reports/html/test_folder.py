from __future__ import annotations

import errno
from pathlib import Path

import pytest

from pytest_garl.errors import SavingError
from pytest_garl.reports.html.folder import check_target, new_folder
from pytest_garl.reports.html.naming import GENERATOR, INDEX

PAGE = f'<meta name="generator" content="{GENERATOR}">'


def write(folder: Path, text: str = "") -> None:
    with new_folder(folder) as inside:
        (inside / INDEX).write_text(PAGE + text)


def names(folder: Path) -> list[str]:
    return sorted(each.name for each in folder.iterdir())


def test_a_report_takes_the_place_of_an_older_one(tmp_path: Path) -> None:
    write(tmp_path / "deep" / "report", "first")
    (tmp_path / "deep" / "report" / "kinds" / "old.html").write_text("old")
    write(tmp_path / "deep" / "report", "second")
    assert (tmp_path / "deep" / "report" / INDEX).read_text().endswith("second")
    assert names(tmp_path / "deep" / "report") == [INDEX, "kinds", "stills"]
    assert not names(tmp_path / "deep" / "report" / "kinds")
    assert names(tmp_path / "deep") == ["report"]


def test_an_empty_folder_may_be_written(tmp_path: Path) -> None:
    (tmp_path / "report").mkdir()
    write(tmp_path / "report")
    assert INDEX in names(tmp_path / "report")


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("notes.txt", "mine", "found a folder with 'notes.txt'"),
        (INDEX, "<html>mine</html>", f"an {INDEX} that is not of {GENERATOR}"),
    ],
)
def test_a_folder_of_somebody_else_stays(tmp_path: Path, name: str, text: str, words: str) -> None:
    (tmp_path / "report").mkdir()
    (tmp_path / "report" / name).write_text(text)
    with pytest.raises(SavingError, match=words):
        write(tmp_path / "report")
    assert (tmp_path / "report" / name).read_text() == text
    assert names(tmp_path / "report") == [name]


def test_a_report_to_which_somebody_added_a_file_stays(tmp_path: Path) -> None:
    write(tmp_path / "report")
    (tmp_path / "report" / "notes.txt").write_text("mine")
    with pytest.raises(SavingError, match=r"found a folder with 'notes\.txt'"):
        check_target(tmp_path / "report")


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "report").write_text("mine")
    with pytest.raises(SavingError, match="found a file, expected a folder"):
        write(tmp_path / "report")
    assert (tmp_path / "report").read_text() == "mine"


def test_a_failure_leaves_the_older_report_whole(tmp_path: Path) -> None:
    write(tmp_path / "report", "first")

    def fail() -> None:
        with new_folder(tmp_path / "report") as inside:
            (inside / INDEX).write_text("half")
            raise OSError(28, "No space left on device")

    with pytest.raises(SavingError, match="No space left on device"):
        fail()
    assert (tmp_path / "report" / INDEX).read_text() == PAGE + "first"
    assert names(tmp_path) == ["report"]


def test_an_interrupt_leaves_nothing(tmp_path: Path) -> None:
    def stop() -> None:
        with new_folder(tmp_path / "report"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stop()
    assert names(tmp_path) == []


def test_a_link_leads_to_the_folder_that_is_written(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "there")
    write(tmp_path / "link")
    assert (tmp_path / "link").is_symlink()
    assert INDEX in names(tmp_path / "there")


@pytest.mark.parametrize("where", ["/proc/report", "/dev/null/report"])
def test_a_place_that_cannot_be_written_is_one_message(where: str) -> None:
    with pytest.raises(SavingError, match=r"cannot be written .*name a folder that may be written"):
        write(Path(where))


def test_a_disk_that_cannot_be_written_is_found_before_the_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    check_target(tmp_path / "report")
    assert names(tmp_path) == []
    # Root may write everywhere.
    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(SavingError, match=r"cannot be written \(No space left on device\)"):
        check_target(tmp_path / "deep" / "report")
    assert names(tmp_path) == []
