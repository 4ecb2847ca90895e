"""The version of the engine, which comes from one of two distributions."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError

import pytest

from pytest_garl.engine import chosen, engine_of, packages
from pytest_garl.flight.flight import version_of


@pytest.mark.parametrize(
    ("installed", "found"),
    [
        ({"pybullet": "3.2.7"}, "3.2.7"),
        ({"pybullet-arm64": "3.2.8"}, "3.2.8"),
        ({"pybullet": "3.2.7", "pybullet-arm64": "3.2.8"}, "3.2.7"),
        ({}, "absent"),
    ],
)
def test_engine_is_found_under_either_name(
    installed: dict[str, str], found: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def version(name: str) -> str:
        if name not in installed:
            raise PackageNotFoundError(name)
        return installed[name]

    monkeypatch.setattr("pytest_garl.flight.flight.version", version)
    assert version_of("pybullet") == found


def test_packages_of_a_flight_are_installed() -> None:
    assert "absent" not in [version_of(name) for name in packages()]
    assert engine_of(tuple((name, "1") for name in packages())) == chosen()
