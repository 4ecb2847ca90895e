"""Run every quick benchmark."""

from __future__ import annotations

from benchmarks import overhead, speed, throughput

speed.main()
overhead.main()
throughput.main()
