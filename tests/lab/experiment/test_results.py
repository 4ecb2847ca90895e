from __future__ import annotations

import multiprocessing
from pathlib import Path

from lab.experiment.results import append_rows, read_rows
from tests.lab.experiment.samples import PLAIN, row

BARE = row(seed=1, violations=0, top10=None, signatures=(), kind_counts=(), violating_distance=None)


def add(path: Path, seeds: range) -> None:
    for seed in seeds:
        append_rows(path, [row(seed=seed, map=map) for map in ("court", "lawn")])


def test_read_returns_appended_rows(tmp_path: Path) -> None:
    path = tmp_path / "new" / "rows.csv"
    assert read_rows(path) == ()
    append_rows(path, [row()])
    append_rows(path, [BARE])
    assert read_rows(path) == (row(), BARE)
    head, first, second = path.read_text().splitlines()
    assert head.split(",") == list(PLAIN)
    assert first.startswith("Lander,court,garl,0,40,10,1,2,0,6,1,3,1,0,4,0,30,II:lost:descent|")
    assert ",,,1.5000,0.1250,," in second


def test_causes_leave_out_phase_and_sight() -> None:
    found = row(signatures=("IV:dog:descent:seen", "IV:dog:last-metre:unseen", "off:seen"))
    assert found.causes == ("IV:dog", "off:seen")


def test_a_search_has_one_row(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    append_rows(path, [row()])
    append_rows(path, [row(violations=11), BARE])
    assert read_rows(path) == (row(), BARE)


def test_simultaneous_appends_lose_no_row(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    context = multiprocessing.get_context("spawn")
    processes = [
        context.Process(target=add, args=(path, range(start, start + 8))) for start in (0, 4)
    ]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
    found = read_rows(path)
    assert {each.key for each in found} == {
        ("Lander", map, "garl", seed, 40, "paper")
        for map in ("court", "lawn")
        for seed in range(12)
    }
    assert len(found) == 24
