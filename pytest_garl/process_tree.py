"""The operating system's processes: which of them live, and which descend from one.

Linux lists them in files; elsewhere, such as on macOS, ``ps`` lists them.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path


def alive(pid: int) -> bool:
    """Return whether a process exists and has not ended."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    # A zombie has ended; its parent has not asked for its status yet.
    return not _has_proc() or _stat(pid)[:1] != ["Z"]


def any_command_contains(text: str) -> bool:
    """Return whether the command line of a living process contains this text."""
    if not _has_proc():
        return any(text in command for _, _, command in _listed())
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            if os.fsencode(text) in file.read_bytes():
                return True
    return False


def children_of(parent: int) -> Iterator[int]:
    """Yield the ids of a process's children, zombies included."""
    if not _has_proc():
        yield from (pid for pid, above, _ in _listed() if above == parent)
        return
    for folder in Path("/proc").glob("[0-9]*"):
        stat = _stat(int(folder.name))
        if len(stat) > 1 and int(stat[1]) == parent:
            yield int(folder.name)


def descendants_of(ancestor: int) -> set[int]:
    """Return the ids of a process's descendants, zombies included."""
    found: set[int] = set()
    new = {ancestor}
    listed = [] if _has_proc() else _listed()
    while new:
        children = {child for parent in new for child in _children_by_thread(parent)}
        children |= {pid for pid, above, _ in listed if above in new}
        new = children - found
        found |= new
    return found


def kill(pids: Iterable[int]) -> None:
    """Kill processes; those that have ended are left out."""
    for pid in pids:
        with contextlib.suppress(OSError):
            os.kill(pid, signal.SIGKILL)


def _children_by_thread(parent: int) -> set[int]:
    """Return a process's children, as its threads list them; no other process is read."""
    found: set[int] = set()
    for file in Path(f"/proc/{parent}/task").glob("*/children"):
        # A process or a thread may end meanwhile.
        with contextlib.suppress(OSError):
            found.update(int(pid) for pid in file.read_text().split())
    return found


def _stat(pid: int) -> list[str]:
    """Return the fields of /proc/PID/stat after the name: state, parent, and so on."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return []


def _has_proc() -> bool:
    """Return whether the system lists its processes in files."""
    return Path("/proc/self/stat").exists()


def _listed() -> list[tuple[int, int, str]]:
    """Return id, parent and command line of all processes except the one that lists them."""
    listing = subprocess.Popen(
        ["ps", "-A", "-o", "pid=", "-o", "ppid=", "-o", "command="],
        stdout=subprocess.PIPE,
        text=True,
        errors="replace",
    )
    rows = re.findall(r"^ *(\d+) +(\d+) *(.*)$", listing.communicate()[0], re.MULTILINE)
    found = [(int(pid), int(above), command) for pid, above, command in rows]
    return [each for each in found if each[0] != listing.pid]
