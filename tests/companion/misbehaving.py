"""Companion programs that do one odd thing, in a module that worker processes import."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from pytest_garl.airframe import Camera
from pytest_garl.companion.companion_program import CompanionProgram
from pytest_garl.external.external_program import ExternalProgram
from tests.external.programs import CLIENTS

FINDINGS = {
    "spins": "V:hung:Timeout",
    "waits_in_c": "V:hung:Timeout",
    "stops": "V:hung:Timeout",
    "floods_stdout": "V:hung:Timeout",
    "floods_stderr": "V:hung:Timeout",
    "floods_the_link": "V:hung:Timeout",
    "kills_its_parent": "V:died:signal-9",
    "kills_its_group": "V:signal-9@kills_its_group",
    "exits": "V:exit-status-3@exits",
    "exits_at_once": "V:exit-status-0@exits_at_once",
    "reads_address_0": "V:signal-11@reads_address_0",
    "closes_all_files": "V:exit-status-1@closes_all_files",
    "forks": "V:RuntimeError@misbehaving_lander.forks",
    "eats_memory": "V:MemoryError@misbehaving_lander.eats_memory",
    "raises": "V:ZeroDivisionError@misbehaving_lander.raises",
    "recurses": "V:RecursionError@misbehaving_lander.recurses",
    "wants_a_package": "V:ModuleNotFoundError@misbehaving_lander.wants_a_package",
    "opens_a_window": "V:RuntimeError@misbehaving_lander.opens_a_window",
    "sends_nan": "V:BadMessage@sends_nan",
    "writes_into_open_files": "V:BadMessage@writes_into_open_files",
}
HARMLESS = (
    "leaves_nothing",
    "ignores_signals",
    "patches_its_clock",
    "deletes_its_folder",
    "sends_garbage",
    "prints_no_utf8",
    "raises_in_a_thread",
    "leaves_threads",
    "leaves_a_daemon",
)
"""What the flight does not notice: it lands."""


def _program(name: str, **options: Any) -> CompanionProgram:
    return CompanionProgram(
        f"python misbehaving_lander.py {name}",
        name=name,
        camera=Camera(width_px=32, height_px=24),
        sources=["misbehaving_lander.py"],
        **options,
    )


def _external(name: str, speed: str) -> ExternalProgram:
    text = f"""
import os, random, time, garl_client
speed = {speed}
link = garl_client.Link(reads=[])
for seen in link:
    link.velocity([speed, 0.0, 0.0])
"""
    path = {"PYTHONPATH": str(CLIENTS)}
    command = [sys.executable, "-S", "-c", text]
    return ExternalProgram(command, name=name, sources=["misbehaving.py"], environment=path)


PROGRAMS = {name: _program(name) for name in (*FINDINGS, *HARMLESS)}
NONDETERMINISTIC = {
    "reads_a_clock_in_c": _program("reads_a_clock_in_c"),
    "hears_a_native_thread": _program("hears_a_native_thread"),
    "hashes": _program("hashes", environment={"PYTHONHASHSEED": "random"}),
    "draws_bytes": _external("draws_bytes", "os.urandom(1)[0] / 256"),
    "draws_a_number": _external("draws_a_number", "random.random()"),
    "reads_a_clock": _external("reads_a_clock", "time.time() % 1"),
}


def left_running() -> list[str]:
    """Return the command lines of programs that live on."""
    found = []
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = file.read_bytes().split(b"\0")
        except OSError:
            continue
        if b"71.5" in words or any(b"misbehaving_lander.py" in word for word in words):
            found.append(b" ".join(words).decode(errors="replace")[:300])
    return found
