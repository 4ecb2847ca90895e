"""Run every quick benchmark."""

from __future__ import annotations

from benchmarks import overhead, speed

speed.main()
overhead.main()
