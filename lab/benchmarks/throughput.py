"""Flights per second of a search with one worker and with two, and the time for 400 flights."""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time


def search_s(workers: int, budget: int, map: str) -> float:
    """Return the wall time of one search of OpenCV-MLS, from start to end of pytest."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
        command += [
            f"--garl-budget={budget}",
            "--garl-shrink=0",
            f"--garl-workers={workers}",
            f"--garl-map={map}",
            "--garl-method=random",
            "--garl-domain=paper",
        ]
        command += ["-o", f"garl_dir={folder}", "landing_systems/test_opencv_mls.py"]
        began = time.perf_counter()
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        if done.returncode not in (0, 1):
            raise SystemExit(done.stdout + done.stderr)
        return time.perf_counter() - began


def main(budget: int = 60) -> None:
    """Print both times on each map, their ratio, and what 400 flights would take."""
    for map in ("court", "lawn"):
        one, two = (search_s(workers, budget, map) for workers in (1, 2))
        print(
            f"{budget} flights on {map}: one worker {one:.0f} s, two {two:.0f} s "
            f"({one / two:.2f} times); 400 flights on two: {400 * two / budget / 60:.1f} min"
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--budget", type=int, default=60)
    main(parser.parse_args().budget)
