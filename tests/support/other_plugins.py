"""Options for runs of pytest in other processes: what they go without."""

from __future__ import annotations

FOREIGN = ("randomly", "rerunfailures", "pytest-retry", "flaky", "timeout", "pytest_cov")
"""Plugins of other projects' habits, which the tests of these habits load by name."""
WITHOUT_FOREIGN = " ".join(f"-p no:{name}" for name in FOREIGN)
WITHOUT_OTHERS = f"-p no:hypothesispytest {WITHOUT_FOREIGN}"
"""Hypothesis's plugin imports all of Hypothesis at the end of each run, which takes longer than
flying; nothing in the projects of these tests uses it.  The tutorial runs with it."""
WITHOUT_PROBES = "-o garl_probes=never"
"""Probes take seconds; ``test_probe_items.py`` asks for them."""
WITHOUT_WORKERS = "-o garl_workers=0"
"""A process more costs more than it flies; tests that need one or several say so."""
FASTER = f"{WITHOUT_OTHERS} {WITHOUT_PROBES} {WITHOUT_WORKERS}"
