"""What all tests that run pytest in processes of their own share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

FOREIGN = ("randomly", "rerunfailures", "pytest-retry", "flaky", "timeout", "pytest_cov")
"""Plugins of other projects' habits, which the tests of these habits load by name."""
WITHOUT_OTHERS = " ".join(f"-p no:{name}" for name in ("hypothesispytest", *FOREIGN))
"""Hypothesis's plugin imports all of Hypothesis at the end of each run, which takes longer than
flying; nothing in the projects of these tests uses it.  The tutorial runs with it."""
WITHOUT_PROBES = "-o garl_probes=never"
"""Probes take seconds; ``test_probe_items.py`` asks for them."""
FASTER = f"{WITHOUT_OTHERS} {WITHOUT_PROBES}"


@pytest.fixture(scope="session", autouse=True)
def faster_runs() -> Iterator[None]:
    """Let runs of pytest in other processes start without other plugins."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTEST_ADDOPTS", FASTER)
        yield


@pytest.fixture(autouse=True)
def faster_runs_of_pytester(request: pytest.FixtureRequest) -> None:
    """Do so for ``pytester``, too, which drops the options of the environment."""
    if "pytester" in request.fixturenames:
        patch: pytest.MonkeyPatch = request.getfixturevalue("monkeypatch")
        request.getfixturevalue("pytester")
        patch.setenv("PYTEST_ADDOPTS", FASTER)
