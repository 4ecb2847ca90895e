from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import pytest

from lab.table import Key, ResultTable
from pytest_garl import cpu_dispatch

ROOT = Path(__file__).parents[2]


def squared(key: Key, pool: Executor) -> dict[str, Any]:
    return {"number": key[0], "square": int(key[0]) ** 2}


def by_which(key: Key, pool: Executor) -> dict[str, Any]:
    return {"number": key[0], "square": pool.submit(cpu_dispatch.dispatched).result()}


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


@pytest.mark.skipif(not cpu_dispatch.has_baseline(), reason="this CPU has no AVX2")
def test_rows_are_flown_by_the_baseline_whatever_this_process_has_loaded(
    table: ResultTable,
) -> None:
    table.file.with_name("study.py").write_text(
        "import numpy, cv2\n"
        "from pathlib import Path\n"
        "from tests.lab.test_table import ResultTable, by_which\n"
        "if __name__ == '__main__':\n"
        f"    file = Path({str(table.file)!r})\n"
        "    table = ResultTable(file=file, columns=('number', 'square'), key=('number',))\n"
        "    table.fly_missing([('2',)], by_which, workers=1)\n"
    )
    command = [sys.executable, str(table.file.with_name("study.py"))]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_CORETYPE": "Sandybridge"}
    environment.pop("NPY_DISABLE_CPU_FEATURES", None)
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert table.rows() == [{"number": "2", "square": cpu_dispatch.BASELINE}]
