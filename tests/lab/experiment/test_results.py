from __future__ import annotations

import multiprocessing
from pathlib import Path

import pytest

from lab.experiment.results import append_rows, read_rows
from pytest_garl.errors import ExperimentError
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
        ("Lander", map, "garl", seed, 40) for map in ("court", "lawn") for seed in range(12)
    }
    assert len(found) == 24


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        (
            ",40,10,",
            ",40,ten,",
            "line 2: column 'violations': found 'ten', expected a whole number",
        ),
        (",1.5000,", ",nan,", "column 'parameter_distance': found 'nan', expected a number"),
        (",4|6", "", "line 2: found too few cells, expected 43"),
        (",eeeeeeeeeeee", ",e,e", "line 2: found too many cells, expected 43"),
        (",4|6", ",4|-6", "column 'kind_counts': found '4|-6', expected whole numbers from 0"),
        (",4|6", ",4|5", "'kind_counts': found 4|5, expected 2 numbers, one for each signature"),
        (",4|6", ",10", "'kind_counts': found 10, expected 2 numbers, one for each signature, 10"),
        (",seed,", ",seeds,", "found other columns than expected: seed, seeds"),
        ("map,method", "method,map", "found other columns than expected, in another order"),
        (",40,10,", ',40,"10"0,', "line 2: not valid CSV"),
    ],
)
def test_the_error_of_a_broken_file_names_line_and_column(
    tmp_path: Path, before: str, after: str, words: str
) -> None:
    path = tmp_path / "rows.csv"
    append_rows(path, [row()])
    path.write_text(path.read_text().replace(before, after, 1))
    with pytest.raises(ExperimentError) as caught:
        read_rows(path)
    assert words in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    (tmp_path / "rows.csv").write_bytes(b"\xff\xfe")
    with pytest.raises(ExperimentError, match="cannot be read"):
        read_rows(tmp_path / "rows.csv")
