"""Programs that do one odd thing, in a module that worker processes import.

Each rises, does the one thing after a second, and lands after three.
"""

from __future__ import annotations

import sys
from pathlib import Path

from pytest_garl.external.external_program import ExternalProgram
from tests.external.programs import CLIENTS, at_once

SCRIPT = r"""
import os, signal, subprocess, sys, threading, time
import garl_client

link = garl_client.Link(reads=[])
x, y, _ = link.mission["home_m"]
me, parent = os.getpid(), os.getppid()

def forks(): os.fork() or time.sleep(71.5)
def forks_on():
    if os.fork(): os._exit(0)
def leaves_a_daemon():
    subprocess.Popen(["sleep", "71.5"], start_new_session=True)
def leaves_threads():
    for _ in range(50): threading.Thread(target=time.sleep, args=(71.5,)).start()
def hangs(): time.sleep(71.5)
def spins():
    while True: pass
def stops(): os.kill(me, signal.SIGSTOP)
def hangs_deaf():
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    time.sleep(71.5)
def kills_itself(): os.kill(me, 9)
def kills_its_group(): os.killpg(0, 9)
def kills_its_parent(): os.kill(parent, 9)
def stops_its_parent(): os.kill(parent, signal.SIGSTOP)
def asks_its_parent_to_end(): os.kill(parent, signal.SIGTERM)
def exits(): os._exit(0)
def aborts(): os.abort()
def closes_all(): os.closerange(0, 256)
def floods_stdout():
    while True: os.write(link._answers, b"x" * 65536)
def floods_stdout_with_lines():
    while True: os.write(link._answers, b'{"type": "land", "frame": 10}\n' * 1000)
def floods_stderr():
    while True: os.write(2, b"x" * 65536)
def answers_late(): time.sleep(0.2)
def patches_its_clock(): time.time = time.monotonic = lambda: 0.0
def eats_memory(): link.memory = bytearray(300_000_000)
def writes_into_the_memory():
    path = link.mission["memory"]["path"]
    with open(path, "r+b") as file: file.write(b"x" * 99)
def cuts_the_memory():
    path = link.mission["memory"]["path"]
    try: os.truncate(path, 0)
    except OSError: pass

for seen in link:
    if seen.frame == 10:
        globals()[sys.argv[1]]()
    if seen.time_s > 3.0:
        link.land(speed_mps=1.0)
    else:
        link.position([x, y, 1.5])
"""
HARMLESS = (
    "forks",
    "forks_on",
    "leaves_a_daemon",
    "leaves_threads",
    "answers_late",
    "patches_its_clock",
    "eats_memory",
    "writes_into_the_memory",
    "cuts_the_memory",
)
"""What the flight does not notice."""
FINDINGS = {
    "exits": "V:exit-status-0@exits",
    "aborts": "V:signal-6@aborts",
    "kills_itself": "V:signal-9@kills_itself",
    "kills_its_group": "V:signal-9@kills_its_group",
    "closes_all": "V:exit-status-1@closes_all",
    "floods_stdout": "V:BadMessage@floods_stdout",
    "floods_stdout_with_lines": "V:BadMessage@floods_stdout_with_lines",
}
SLOW_FINDINGS = {
    "hangs": "V:hung:Timeout",
    "spins": "V:hung:Timeout",
    "stops": "V:hung:Timeout",
    "hangs_deaf": "V:hung:Timeout",
    "floods_stderr": "V:hung:Timeout",
    "kills_its_parent": "V:died:signal-9",
    "stops_its_parent": "V:hung:Timeout",
    "asks_its_parent_to_end": "V:died:signal-15",
}
"""What ends a worker, or lets it wait for the limit of a call, mostly twice."""


def _program(name: str) -> ExternalProgram:
    return ExternalProgram(
        [sys.executable, "-S", "-c", SCRIPT, name],
        name=name,
        airframe=at_once(),
        sources=["misbehaving.py"],
        environment={"PYTHONPATH": str(CLIENTS)},
    )


PROGRAMS = {name: _program(name) for name in (*HARMLESS, *FINDINGS, *SLOW_FINDINGS)}


def left_running() -> list[str]:
    """Return the names of programs that live on."""
    found = []
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = file.read_bytes().split(b"\0")
        except OSError:
            continue
        if SCRIPT.encode() in words or b"71.5" in words:
            found.append(words[-2].decode(errors="replace"))
    return found
