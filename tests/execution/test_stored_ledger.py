"""Ledgers of earlier processes: sound ones are taken, damaged ones are one clear error."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.errors import LedgerError
from pytest_garl.execution.database import VERSION, Database
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.stored_ledger import check_stored
from pytest_garl.gate.record import baseline_from_ledger
from pytest_garl.scenarios.files import dump_scenario
from tests.execution.flying import scenario
from tests.gate.samples import job, write_ledger
from tests.support.results import flight_result


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write_ledger(tmp_path / "ledger.sqlite", job())
    return tmp_path / "ledger.sqlite"


def _checked(path: Path) -> None:
    ledger = Ledger(path)
    try:
        check_stored(ledger)
    finally:
        ledger.close()


def _run(path: Path, sql: str, *values: Any) -> None:
    database = sqlite3.connect(path)
    database.execute(sql, values)
    database.commit()
    database.close()


def test_check_accepts_a_sound_ledger(path: Path) -> None:
    _checked(path)


def _changed(**values: Any) -> str:
    return json.dumps({**flight_result().to_json(), **values})


def _verdict(**values: Any) -> str:
    return _changed(verdict={**flight_result().to_json()["verdict"], **values})


def _job(change: Callable[[dict[str, Any]], object]) -> str:
    values = json.loads(job().dumps())
    change(values)
    return json.dumps(values)


MARGIN = {"property": "time", "value": 1.0, "unit": "s", "decided": True, "reason": ""}
RESULT = "UPDATE slot SET result = ? WHERE slot = 0"
JOB = "UPDATE search SET job = ?"
SCENARIO = "UPDATE slot SET scenario = ? WHERE slot = 1"


@pytest.mark.parametrize(
    ("sql", "value", "words"),
    [
        (RESULT, "{", "slot 0/0 of a: not valid JSON"),
        (RESULT, "[" * 100_000, "slot 0/0 of a: not valid JSON: nested too deeply"),
        (RESULT, "[]", r"found \[\]"),
        (RESULT, b"\xff", "slot.result: found blob, expected text or null"),
        (RESULT, _changed(outcome=1), "slot 0/0 of a: outcome: found 1, expected a text"),
        (RESULT, _changed(elapsed_s="x"), "elapsed_s: found 'x', expected a finite number"),
        (RESULT, '{"outcome": "landed"}', "found other keys than expected: closest_body"),
        (RESULT, _verdict(primary="bad"), "verdict.primary: found 'bad', expected one of 'dist"),
        (RESULT, _verdict(margins=[{}]), r"verdict.margins\[0\]: found other keys"),
        (RESULT, _verdict(margins=[MARGIN | {"value": None}]), r"margins\[0\].value: found None"),
        (RESULT, _changed(crash={"kind": "raised"}), "crash: found other keys than expected"),
        (RESULT, None, "slot 0/0 of a: found the state flown without a result"),
        (
            JOB,
            "{}",
            "search 'a': the value: found other keys than expected: engine, flights, limits",
        ),
        (JOB, _job(lambda job: job.update(timeout_s="1")), "timeout_s: found '1', expected a fin"),
        (JOB, _job(lambda job: job["limits"].update(time_s=1e9)), "limits: found time_s=1000000"),
        (JOB, _job(lambda job: job["npcs"].update(arguments=[["a"]])), "npcs.arguments.0.: found"),
        (SCENARIO, "5", "slot 0/1 of a: the value: found 5, expected a table"),
        (SCENARIO, '{"map": "lawn", "seed": 1, "genes": [["a", "b"]]}', r"genes\[0\]\[1\]: found"),
        ("UPDATE slot SET state = ?", "lost", "or the state 'lost'"),
        ("UPDATE slot SET search = ? WHERE slot = 1", "b", "slot 0/1 of b: found no such search"),
        ("UPDATE slot SET generation = ?", "x", "slot.generation: found text, expected integer"),
        ("UPDATE slot SET slot = -1 WHERE slot = ?", 1, "slot 0/-1 of a: found no such"),
        ("UPDATE slot SET wall_s = ?", "x", "slot.wall_s: found text, expected real or integer"),
        ("UPDATE search SET kind = ?", "x", r"search 'a': found \('x', 2\)"),
        ("UPDATE search SET wanted = ?", b"x", "search.wanted: found blob, expected integer"),
        ("UPDATE run SET value = ?", "3", f"found a ledger of version 3, expected {VERSION}"),
        ("UPDATE run SET value = ?", "[[", "the fact 'ledger' is damaged: not valid JSON"),
        ("UPDATE run SET key = ?", "x", f"found a ledger of version None, expected {VERSION}"),
        ("UPDATE meter SET value = ?", "x", "meter.value: found text, expected real"),
    ],
)
def test_check_names_a_damaged_row_in_one_short_error(
    path: Path, sql: str, value: Any, words: str
) -> None:
    _run(path, sql, value)
    with pytest.raises(LedgerError, match=words) as caught:
        _checked(path)
    assert str(caught.value).startswith(f"{path}: is damaged or no ledger of this version: ")
    assert len(str(caught.value)) < 800
    with pytest.raises(LedgerError, match=words):
        baseline_from_ledger(path)


@pytest.mark.parametrize("table", ["run", "search", "slot", "meter"])
def test_check_names_a_missing_table(path: Path, table: str) -> None:
    _run(path, f"DROP TABLE {table}")
    with pytest.raises(LedgerError, match=f"no such table: {table}"):
        _checked(path)


@pytest.mark.long
def test_query_on_a_damaged_page_raises_a_ledger_error(path: Path) -> None:
    ledger = Ledger(path)
    ledger.add_slots("a", 1, {slot: dump_scenario(scenario(0.1)) for slot in range(200)})
    ledger.database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    ledger.close()
    content = bytearray(path.read_bytes())
    for page in range(8, len(content) // 4096):
        content[page * 4096 : page * 4096 + 12] = b"\xff" * 12
    path.write_bytes(content)
    with pytest.raises(LedgerError, match="is damaged or no ledger"):
        _checked(path)
    ledger = Ledger(path)
    with pytest.raises(LedgerError, match="database disk image is malformed"):
        ledger.queries.scenarios(1, 150, "lawn")
    with pytest.raises(LedgerError, match="database disk image is malformed"):
        ledger.queries.result_hash()
    ledger.close()


def test_error_during_the_fetch_of_rows_is_a_ledger_error(tmp_path: Path) -> None:
    database = Database(tmp_path / "some.sqlite")
    rows = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 5000) "
    with pytest.raises(LedgerError, match=r"some.sqlite: malformed JSON"):
        database.execute(rows + "SELECT json_extract(iif(i < 4000, '{}', '{'), '$.a') FROM n")
    database.close()


def test_database_refuses_a_value_as_large_as_the_memory(tmp_path: Path) -> None:
    database = Database(tmp_path / "some.sqlite")
    with pytest.raises(LedgerError, match="string or blob too big"):
        database.execute("SELECT zeroblob(100000000)")
    database.close()


def test_check_finds_damage_in_a_page_that_no_query_reads(path: Path) -> None:
    database = sqlite3.connect(path)
    sql = "SELECT rootpage FROM sqlite_master WHERE name = 'slot_state'"
    (page,) = database.execute(sql).fetchone()
    database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    database.close()
    content = bytearray(path.read_bytes())
    content[(page - 1) * 4096] = 0xFF
    path.write_bytes(content)
    with pytest.raises(LedgerError, match="is damaged or no ledger"):
        _checked(path)


def test_error_that_quotes_damaged_bytes_is_a_ledger_error(path: Path) -> None:
    content = path.read_bytes()
    start = content.index(b"tablemetermeter")
    damaged = content[:start] + b"tablem\x8aterm\x8ater" + content[start + 15 :]
    path.write_bytes(damaged)
    with pytest.raises(LedgerError, match=r"ledger\.sqlite"):
        _checked(path)


def test_error_shortens_the_name_of_a_search(path: Path) -> None:
    _run(path, "UPDATE slot SET search = ? WHERE slot = 1", "9" * 5000)
    with pytest.raises(LedgerError, match=r"slot 0/1 of 999.*…9+: found no such search") as caught:
        _checked(path)
    assert len(str(caught.value)) < 500
