"""Run every quick benchmark."""

from __future__ import annotations

from lab.benchmarks import collect, field, ledger, overhead, programs, speed, throughput

speed.main()
overhead.main()
collect.main()
ledger.main()
throughput.main()
field.main()
programs.main()
