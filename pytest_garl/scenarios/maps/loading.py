"""Maps by name: those of the package, and a project's own."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from pathlib import Path

from pytest_garl.errors import ScenarioError
from pytest_garl.messages import listed, shown
from pytest_garl.scenarios.maps.map import Map


def map_names(search_path: Sequence[Path] = ()) -> tuple[str, ...]:
    """Names of all maps that can be found: the package's and the user's."""
    return tuple(
        sorted({file.stem for folder in _folders(search_path) for file in _maps_in(folder)})
    )


def load_map(name: str, search_path: Sequence[Path] = ()) -> Map:
    """Return the map ``<name>.toml`` from the search path, or else from the package.

    Raises ScenarioError for an unknown name or a broken file; the message names file and
    key.
    """
    for folder in _folders(search_path):
        file = folder / f"{name}.toml"
        if file in _maps_in(folder):
            return _read(file, _modified_ns(file))
    raise ScenarioError(
        f"unknown map {shown(name)}; expected one of {listed(map_names(search_path))}. "
        "A map of your own is a file scenarios/maps/<name>.toml"
    )


def _modified_ns(file: Path) -> int:
    try:
        return file.stat().st_mtime_ns
    except OSError as error:
        # A link whose target is missing, or a link to itself.
        raise ScenarioError(f"{file}: cannot be read: {error.strerror}") from error


@functools.lru_cache(maxsize=64)
def _read(file: Path, modified_ns: int) -> Map:
    """Read a file; the cache reads it again if its modification time has changed."""
    from pytest_garl.scenarios.maps.map_file import read_map

    del modified_ns
    return read_map(file)


def _folders(search_path: Sequence[Path]) -> tuple[Path, ...]:
    return (*search_path, Path(__file__).parent)


def _maps_in(folder: Path) -> tuple[Path, ...]:
    return tuple(sorted(folder.glob("*.toml"))) if folder.is_dir() else ()
