"""Loads many broken files in a child of bounded memory, and counts what comes of it."""

from __future__ import annotations

import collections
import contextlib
import json
import os
import random
import resource
import select
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any

MEMORY_BYTES = 1_000_000_000
SECONDS = 10.0
"""Of CPU time for one file, so that a busy machine makes no hang."""
_SILENT_S = 300.0
"""Of wall time: no signal reaches a child that hangs in C code."""
LONGEST = 1200
"""Characters of a message: an error that fills the screen is not clear."""
OUTCOMES = ("loaded", "clear error", "raw traceback", "hang", "memory", "unclear error")
GOOD = ("loaded", "clear error")


class Hang(BaseException):
    """A file that takes longer than SECONDS."""


def run(loader: str, count: int, seed: int) -> tuple[collections.Counter[str], list[str], float]:
    """Return the outcomes of ``count`` files, what went wrong, and the peak of memory in MB."""
    counts: collections.Counter[str] = collections.Counter()
    wrong, peak, done = [], 0.0, 0
    while done < count:
        for line in _child(loader, seed, done, count):
            if line is None:
                counts["hang"] += 1
                wrong.append(f"{loader} {seed}/{done}: the child is silent or was killed")
                done += 1
                break
            counts[line["outcome"]] += 1
            peak = max(peak, line["peak_mb"])
            if line["outcome"] not in GOOD:
                wrong.append(f"{loader} {seed}/{done}: {line['outcome']}: {line['text']}")
            done += 1
    return counts, wrong, peak


def _child(loader: str, seed: int, start: int, count: int) -> Iterator[dict[str, Any] | None]:
    command = [sys.executable, "-m", "tests.fuzz.campaign", loader, *map(str, (seed, start, count))]
    env = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    with subprocess.Popen(command, stdout=subprocess.PIPE, env=env, cwd=_ROOT) as child:
        assert child.stdout is not None
        file = child.stdout.fileno()
        kept, told = b"", 0
        try:
            while told < count - start:
                ready, _, _ = select.select([file], [], [], _SILENT_S)
                chunk = os.read(file, 1 << 16) if ready else b""
                if not chunk:
                    yield None
                    return
                *lines, kept = (kept + chunk).split(b"\n")
                for line in lines:
                    told += 1
                    yield json.loads(line)
        finally:
            child.kill()


_ROOT = Path(__file__).parents[2]


def load_all(loader: str, seed: int, start: int, count: int) -> None:
    """Load files ``start`` to ``count`` in this process and write a line about each."""
    from tests.fuzz.loaders import LOADERS

    sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]
    with tempfile.TemporaryDirectory() as folder:
        # Samples are made, and all is imported, before the memory is bounded.
        LOADERS[loader].prepare(Path(folder), random.Random(0))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
        for index in range(start, count):
            outcome, text = load_one(loader, seed, index, Path(folder))
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000
            sys.stdout.write(
                json.dumps({"outcome": outcome, "text": text[-1500:], "peak_mb": peak}) + "\n"
            )


def load_one(loader: str, seed: int, index: int, folder: Path) -> tuple[str, str]:
    """Change and load one file; return the outcome and the error's text."""
    from pytest_garl.errors import GarlError
    from tests.fuzz.loaders import LOADERS

    rng = random.Random(f"{loader} {seed} {index}")
    path = LOADERS[loader].prepare(folder, rng)
    try:
        with _time_limit():
            LOADERS[loader].load(path, rng)
    except GarlError as error:
        return _judged(error, path)
    except Hang:
        return "hang", traceback.format_exc()
    except MemoryError:
        return "memory", traceback.format_exc()
    except Exception:  # noqa: BLE001 (that is what is looked for)
        return "raw traceback", traceback.format_exc()
    return "loaded", ""


def _judged(error: BaseException, path: Path) -> tuple[str, str]:
    text = str(error)
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, MemoryError) and "parser" not in str(cause):
            return "memory", text
        cause = cause.__cause__
    names_it = path.name in text or path.with_suffix("").name in text or "ledger" in text
    seen = all(char.isprintable() or char in "\n\t" for char in text)
    if not names_it or not seen or len(text) > LONGEST:
        return "unclear error", f"{len(text)} characters: {text[:LONGEST]!r}"
    return "clear error", text


@contextlib.contextmanager
def _time_limit() -> Iterator[None]:
    def stop(*_: object) -> None:
        raise Hang

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def main(each: int = 3000, seed: int = 1) -> int:
    """Print a table over all loaders; return how many files were not loaded or refused clearly."""
    from tests.fuzz.loaders import LOADERS

    bad = 0
    print(f"{each} files of each kind, seed {seed}, at most {MEMORY_BYTES / 1e6:.0f} MB")
    print("| kind | " + " | ".join(OUTCOMES) + " | peak MB | CPU s |")
    print("| --- " * (len(OUTCOMES) + 3) + "|")
    for loader in LOADERS:
        before = time.process_time() + sum(os.times()[2:4])
        counts, wrong, peak = run(loader, each, seed)
        cpu = time.process_time() + sum(os.times()[2:4]) - before
        cells = " | ".join(str(counts[name]) for name in OUTCOMES)
        print(f"| {loader} | {cells} | {peak:.0f} | {cpu:.0f} |", flush=True)
        for line in wrong:
            print(line, file=sys.stderr, flush=True)
        bad += len(wrong)
    return bad


if __name__ == "__main__":
    name, *numbers = sys.argv[1:]
    load_all(name, *(int(number) for number in numbers))
