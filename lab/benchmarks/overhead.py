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
    """Run pytest with and without the plugin in turns; print the difference of the fastest runs.

    The mean of the fastest quarter of each is compared.
    """
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "test_plain.py").write_text("def test_plain(): pass\n")
        times: dict[str, list[float]] = {"no:garl": [], "garl": []}
        # Keep the compiled files, as on a user's machine.
        environment = {**os.environ, "PYTHONPYCACHEPREFIX": folder}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        for _ in range(repeats):
            for name, seconds in times.items():
                options = ["-p", name] if name.startswith("no:") else []
                command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *options]
                began = time.perf_counter()
                subprocess.run(
                    command, cwd=folder, check=True, capture_output=True, env=environment
                )
                seconds.append(time.perf_counter() - began)
        without_plugin, with_plugin = (
            statistics.mean(sorted(times[name])[: repeats // 4]) for name in times
        )
        added_s, factor = with_plugin - without_plugin, with_plugin / without_plugin
        print(f"plugin overhead: {1000 * added_s:.1f} ms ({factor:.3f} times)")


if __name__ == "__main__":
    main()
