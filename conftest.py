"""Pytest configuration of this repository: the plugin is tested with ``pytester``."""

from __future__ import annotations

pytest_plugins = ["pytester"]
