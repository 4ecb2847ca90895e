"""Broken files of all kinds: `python -m tests.fuzz` loads 30,000 of them."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from tests.fuzz import campaign
from tests.fuzz.loaders import LOADERS


@pytest.mark.parametrize("loader", LOADERS)
def test_a_broken_file_is_loaded_or_refused_clearly(loader: str, tmp_path: Path) -> None:
    outcomes = [campaign.load_one(loader, 2, index, tmp_path) for index in range(25)]
    assert [each for each in outcomes if each[0] not in campaign.GOOD] == []
    assert any(outcome == "clear error" for outcome, _ in outcomes)


@pytest.mark.long
@pytest.mark.parametrize("loader", LOADERS)
def test_many_broken_files_neither_hang_nor_fill_the_memory(loader: str) -> None:
    counts, wrong, peak_mb = campaign.run(loader, 1000, seed=3)
    assert wrong == []
    assert counts.total() == 1000
    assert counts["loaded"] > 10
    assert peak_mb < campaign.MEMORY_BYTES / 1e6


def test_the_campaign_counts_every_kind_of_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def outcome(error: BaseException | None) -> str:
        def load(path: Path, rng: object) -> None:
            if error is not None:
                raise error

        monkeypatch.setitem(LOADERS, "experiment", replace(LOADERS["experiment"], load=load))
        return campaign.load_one("experiment", 1, 0, tmp_path)[0]

    from pytest_garl.errors import GarlError

    assert outcome(None) == "loaded"
    assert outcome(GarlError("plan.toml: wrong")) == "clear error"
    assert outcome(GarlError("something is wrong")) == "unclear error"
    assert outcome(GarlError("plan.toml: " + "x" * campaign.LONGEST)) == "unclear error"
    assert outcome(KeyError("x")) == "raw traceback"
    assert outcome(MemoryError()) == "memory"
    assert outcome(campaign.Hang()) == "hang"


def test_a_file_that_takes_too_long_is_a_hang(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def load(path: Path, rng: object) -> None:
        while True:
            pass

    monkeypatch.setitem(LOADERS, "experiment", replace(LOADERS["experiment"], load=load))
    monkeypatch.setattr(campaign, "SECONDS", 0.05)
    assert campaign.load_one("experiment", 1, 0, tmp_path)[0] == "hang"


def test_the_same_seed_makes_the_same_files(tmp_path: Path) -> None:
    def files(folder: Path) -> list[bytes]:
        folder.mkdir()
        found = []
        for loader in ("case", "record", "weights"):
            campaign.load_one(loader, 4, 7, folder)
            (path,) = [each for each in folder.rglob("*") if each.suffix in (".toml", ".npz")]
            found.append(path.read_bytes())
            path.unlink()
        return found

    assert files(tmp_path / "one") == files(tmp_path / "two")


def test_the_campaign_counts_a_child_that_dies(monkeypatch: pytest.MonkeyPatch) -> None:
    real = subprocess.Popen

    def short(command: list[str], **rest: object) -> object:
        # The limit leaves no memory for the child's own imports.
        return real(["prlimit", "--as=50000000", *command], **rest)  # type: ignore[call-overload]

    monkeypatch.setattr(subprocess, "Popen", short)
    counts, wrong, _ = campaign.run("experiment", 2, seed=1)
    assert counts["hang"] == 2
    assert len(wrong) == 2
