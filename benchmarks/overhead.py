"""The time that the plugin adds to a test run without landing tests."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path


def main(repeats: int = 30) -> None:
    """Print the difference of the fastest quarters of runs with and without it, in turns."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "test_plain.py").write_text("def test_plain(): pass\n")
        times: dict[str, list[float]] = {"no:garl": [], "garl": []}
        # As on a user's machine, where the compiled files are kept.
        own = {**os.environ, "PYTHONPYCACHEPREFIX": folder}
        own.pop("PYTHONDONTWRITEBYTECODE", None)
        for _ in range(repeats):
            for name, taken in times.items():
                switch = ["-p", name] if name.startswith("no:") else []
                command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *switch]
                began = time.perf_counter()
                subprocess.run(command, cwd=folder, check=True, capture_output=True, env=own)
                taken.append(time.perf_counter() - began)
        without, with_it = (statistics.mean(sorted(times[name])[: repeats // 4]) for name in times)
        print(
            f"plugin overhead: {1000 * (with_it - without):.1f} ms ({with_it / without:.3f} times)"
        )


if __name__ == "__main__":
    main()
