from __future__ import annotations

from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import pytest

from lab.table import Key, ResultTable


def squared(key: Key, pool: Executor) -> dict[str, Any]:
    return {"number": key[0], "square": int(key[0]) ** 2}


@pytest.fixture
def table(tmp_path: Path) -> ResultTable:
    return ResultTable(file=tmp_path / "squares.csv", columns=("number", "square"), key=("number",))


def test_a_table_without_a_file_is_empty(table: ResultTable) -> None:
    assert table.rows() == []
    assert table.keys() == set()


def test_fly_missing_appends_a_row_for_each_key_without_one(table: ResultTable) -> None:
    table.append([{"number": 2, "square": "kept"}])
    table.fly_missing([("2",), ("3",)], squared, workers=1)
    assert table.file.read_bytes() == b"number,square\n2,kept\n3,9\n"
    assert table.keys() == {("2",), ("3",)}


def test_columns_that_an_older_file_lacks_are_empty_and_added_with_the_next_row(
    table: ResultTable,
) -> None:
    table.file.write_text("number\n2\n")
    assert table.rows() == [{"number": "2", "square": ""}]
    table.append([{"number": 3, "square": 9}])
    assert table.file.read_text().splitlines() == ["number,square", "2,", "3,9"]
