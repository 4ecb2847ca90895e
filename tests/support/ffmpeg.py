"""An ffmpeg that does what a test wants, and a machine without one."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

LISTS = 'case "$*" in *-encoders*) echo " V....D libx264  H.264"; exit 0;; esac'
"""The line of a shell that answers as an ffmpeg which can encode."""


def an_ffmpeg(folder: Path, *lines: str) -> Path:
    """Write an ffmpeg that does what lines of a shell say; return it."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "ffmpeg"
    path.write_text("\n".join(["#!/bin/sh", *lines, ""]))
    path.chmod(0o755)
    return path


def hide_encoders(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let there be neither ffmpeg on PATH nor imageio-ffmpeg."""
    monkeypatch.setenv("PATH", "")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
