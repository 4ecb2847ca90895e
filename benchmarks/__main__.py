"""Run every quick benchmark."""

from __future__ import annotations

from benchmarks import ledger, overhead, speed, throughput

speed.main()
overhead.main()
ledger.main()
throughput.main()
