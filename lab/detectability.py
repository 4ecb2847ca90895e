"""Calibrates the detectability oracle on painted frames that independent detectors read.

``python -m lab.detectability`` draws and reads the frames (15 minutes on two cores) unless
``--frames`` names a file that has them, fits the oracle, writes its coefficients, and prints how
well it predicts frames that it was not fitted to.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import json
import multiprocessing
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.detectability_conditions import CONDITIONS
from lab.detectability_fit import auc, brier, deciles, fit
from lab.detectability_frames import KINDS, MAPS, Detectors, Kind, ReadFrame, read_frames
from pytest_garl.flight.detectability import COEFFICIENTS, Network, features
from pytest_garl.flight.flight import MarkerView

Array = NDArray[np.float64]
FIELDS = tuple(field.name for field in dataclasses.fields(MarkerView))
COLUMNS = ("scenario", "map", *CONDITIONS, "height_m", *FIELDS, "stock", "good", "learned")
CHUNK = 20
WHOLE = 0.9
"""Share of the marker in the frame from which frames count in the calibration."""


def table_of(frames: Iterable[ReadFrame]) -> Array:
    """Return one row of ``COLUMNS`` per frame."""
    rows = [
        (
            each.scenario,
            MAPS.index(each.map),
            *each.conditions,
            each.height_m,
            *dataclasses.astuple(each.view),
            *each.read,
        )
        for each in frames
    ]
    return np.array(rows, dtype=np.float64).reshape(len(rows), len(COLUMNS))


def features_of(table: Array) -> Array:
    """Return the oracle's features of each row."""
    first = COLUMNS.index(FIELDS[0])
    views = table[:, first : first + len(FIELDS)].tolist()
    return np.array(
        [features(MarkerView(**dict(zip(FIELDS, view, strict=True)))) for view in views]
    )


def reads_of(table: Array) -> Array:
    """Return whether each detector reads each row's frame, shape (n, 3)."""
    reads: Array = table[:, -3:]
    return reads


def half_of(table: Array) -> NDArray[np.intp]:
    """Return the half, 0 or 1, to which each row's scenario belongs; both have both maps."""
    half: NDArray[np.intp] = table[:, 0].astype(int) // len(MAPS) % 2
    return half


def fitted(tables: Sequence[Array]) -> Network:
    """Return the network fitted to all rows of some tables."""
    rows = np.concatenate(tables)
    return fit(features_of(rows), reads_of(rows).max(axis=1))


def held_out(tables: Sequence[Array]) -> list[Array]:
    """Return the predictions of each table's rows, by oracles that have not seen the row's half."""
    predicted = [np.zeros(len(table)) for table in tables]
    for half in (0, 1):
        oracle = fitted([table[half_of(table) != half] for table in tables])
        for table, into in zip(tables, predicted, strict=True):
            chosen = half_of(table) == half
            into[chosen] = oracle.probabilities(features_of(table[chosen]))
    return predicted


def score_line(kind: str, table: Array, predicted: Array) -> str:
    """Return AUC, Brier score and the largest error of ten groups of equal size."""
    whole = table[:, COLUMNS.index("share_in_frame")] >= WHOLE
    read, predicted = reads_of(table[whole]).max(axis=1), predicted[whole]
    worst = max(abs(each.error) for each in deciles(predicted, read))
    return (
        f"{kind}: {len(read)} frames with the whole marker, {read.mean():.3f} of them read, "
        f"{predicted.mean():.3f} predicted, AUC {auc(predicted, read):.3f}, "
        f"Brier score {brier(predicted, read):.3f}, largest error of a tenth {worst:.3f}"
    )


@functools.cache
def detectors() -> Detectors:
    """Return this process's detectors."""
    return Detectors()


def chunk(numbers: tuple[int, ...], kind: Kind) -> Array:
    """Return the table of some scenarios."""
    frames = [each for n in numbers for each in read_frames(n, detectors(), kind)]
    return table_of(frames)


def pinned_processes(workers: int) -> ProcessPoolExecutor:
    """Return processes that compute alike on every machine, with one thread each."""
    return ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"))


def generate(scenarios: int, kind: Kind, workers: int) -> Array:
    """Draw, paint and read the frames of scenarios, in their order, whatever the workers."""
    chunks = [tuple(range(at, min(scenarios, at + CHUNK))) for at in range(0, scenarios, CHUNK)]
    began, tables = time.monotonic(), []
    with pinned_processes(workers) as pool:
        for done, table in enumerate(pool.map(chunk, chunks, [kind] * len(chunks)), start=1):
            tables.append(table)
            left_s = (time.monotonic() - began) / done * (len(chunks) - done)
            print(f"{done}/{len(chunks)} chunks, {left_s / 60:.0f} minutes left", flush=True)
    return np.concatenate(tables)


def main() -> None:
    """Draw the frames where there are none, fit, write the coefficients, and print the scores."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenarios", type=int, default=2000, help="default 2000")
    parser.add_argument(
        "--others", type=int, default=250, help="blurred, far, cut, and cluttered; default 250 each"
    )
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--frames", type=Path, default=Path(".garl/detectability.npz"))
    parser.add_argument("--coefficients", type=Path, default=COEFFICIENTS)
    arguments = parser.parse_args()
    if not arguments.frames.exists():
        counts = (arguments.scenarios, *[arguments.others] * (len(KINDS) - 1))
        drawn = [generate(*each, arguments.workers) for each in zip(counts, KINDS, strict=True)]
        arguments.frames.parent.mkdir(parents=True, exist_ok=True)
        named: dict[str, Any] = dict(zip(KINDS, drawn, strict=True))
        np.savez_compressed(arguments.frames, **named)
    with np.load(arguments.frames) as file:
        tables = [file[kind] for kind in KINDS]
    with pinned_processes(1) as process:
        oracle = process.submit(fitted, tables).result()
        predicted = process.submit(held_out, tables).result()
    values = json.dumps(dataclasses.asdict(oracle), indent=1)
    arguments.coefficients.write_text(values + "\n", encoding="utf-8")
    for each in zip(KINDS, tables, predicted, strict=True):
        print(score_line(*each))


if __name__ == "__main__":
    main()
