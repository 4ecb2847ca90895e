"""Picture of timing and burst: how old each frame is when it reaches the landing system."""

from __future__ import annotations

from pathlib import Path

from studies.conditions._frames import plots, save, watched
from tests.support.flights import nominal

SECONDS = 14.0
CASES = {
    "latency_ms = 200": {"timing__latency_ms": 200.0},
    "jitter_ms = 50": {"timing__jitter_ms": 50.0},
    "dropped_percent = 20": {"timing__dropped_percent": 20.0},
    "stamp_error_ms = -100": {"timing__stamp_error_ms": -100.0},
    "burst: latency_ms = 1000 from 5 s for 5 s": {
        "burst__from_s": 5.0,
        "burst__lasts_s": 5.0,
        "burst__latency_ms": 1000.0,
    },
}


def draw(folder: Path) -> None:
    """Draw ``timing.png``."""
    figure, axes = plots().subplots(len(CASES), 1, figsize=(9.0, 6.5), constrained_layout=True)
    for axis, (title, values) in zip(axes, CASES.items(), strict=True):
        flight, observations = watched(nominal(**values), SECONDS)
        arrivals = [step.time_s for step in flight.steps]
        late_ms = [
            1000 * (arrival - each.time_s)
            for arrival, each in zip(arrivals, observations, strict=True)
        ]
        axis.plot(arrivals, late_ms, "|", markersize=9)
        axis.set(title=title, ylabel="ms", xlim=(0, SECONDS))
        axis.set_ylim(min(-50.0, *late_ms), 1.2 * max(100.0, *late_ms))
        print(f"{title}: {len(arrivals)} calls, {min(late_ms):.0f} to {max(late_ms):.0f} ms")
    axes[-1].set_xlabel("time at which step is called (s)")
    save(figure, folder / "timing.png")
