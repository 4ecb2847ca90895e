"""The file in which a project sets pytest's ini keys, and how settings are added to it."""

from __future__ import annotations

import configparser
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pytest_garl.errors import GarlError

SETTINGS = {"garl_domain": ("field", "where the system is to land: garl domain show field")}
"""Each ini key with its value, the default, and what it means.  `garl_cases` is none of them: a
folder that it names must exist, and there is none before the first case."""
PYTHONPATH = {"pythonpath": (".", "so that the tests find your modules")}
_INI_SECTIONS = {
    "pytest.ini": "pytest",
    ".pytest.ini": "pytest",
    "tox.ini": "pytest",
    "setup.cfg": "tool:pytest",
}
_TOML_TABLES = {
    "pytest.toml": ("pytest",),
    ".pytest.toml": ("pytest",),
    "pyproject.toml": ("tool.pytest.ini_options", "tool.pytest"),
}
_ORDER = (
    "pytest.toml",
    ".pytest.toml",
    "pytest.ini",
    ".pytest.ini",
    "pyproject.toml",
    "tox.ini",
    "setup.cfg",
)
"""The order in which pytest looks for its settings."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SettingsFile:
    """A file with pytest's settings; ``section`` is empty if it has none yet."""

    file: Path
    section: str
    values: Mapping[str, Any] = field(default_factory=dict)
    """The keys that are set already, with what they are set to."""

    @property
    def test_paths(self) -> list[str]:
        """Where pytest looks for tests if the command names none; empty: everywhere."""
        found = self.values.get("testpaths", ())
        return found.split() if isinstance(found, str) else [str(each) for each in found]

    def add(self, settings: Mapping[str, tuple[str, str]]) -> str:
        """Add the settings that are missing; return in a word what was done.

        Raises GarlError if the file has no place for them, or cannot be read or written.
        """
        missing = [key for key in settings if key not in self.values]
        if not missing:
            return "unchanged"
        is_new, is_toml = not self.file.exists(), self.file.suffix == ".toml"
        before = "" if is_new else _text_of(self.file)
        lines = []
        for key in missing:
            value, meaning = settings[key]
            shown = _in_toml(key, value) if is_toml else value
            lines += [f"# {meaning}", f"{key} = {shown}"]
        if self.section:
            text = _with_lines_in(before, self.section, lines)
        else:
            section = _TOML_TABLES[self.file.name][0] if is_toml else "pytest"
            gap = "" if not before else "\n" if before.endswith("\n") else "\n\n"
            text = "\n".join([f"{before}{gap}[{section}]", *lines, ""])
        if not _has_settings(text, self.file, missing):
            wanted = "\n".join(f"    {line}" for line in lines)
            raise GarlError(
                f"{self.file.name}: the place of pytest's settings was not found; add these lines "
                f"to them:\n{wanted}"
            )
        try:
            with self.file.open("w", encoding="utf-8", newline="") as opened:
                opened.write(text)
        except OSError as error:
            raise GarlError(f"{self.file}: cannot be written ({error})") from error
        return "wrote" if is_new else "added to"


def find_settings(folder: Path) -> SettingsFile:
    """Return the file from which pytest takes its settings in this folder, or will."""
    for name in _ORDER:
        file = folder / name
        found = _read(file) if file.is_file() else None
        if found is not None:
            return found
    pyproject = folder / "pyproject.toml"
    file = pyproject if pyproject.is_file() else folder / "pytest.ini"
    return SettingsFile(file=file, section="")


def _read(file: Path) -> SettingsFile | None:
    """Return a file with its settings of pytest; None if it has none."""
    text = _text_of(file)
    if file.name in _TOML_TABLES:
        values = _toml(text, file)
        for name in _TOML_TABLES[file.name]:
            table = _table(values, name)
            if table is not None:
                return SettingsFile(file=file, section=name, values=table)
        # pytest takes its own files also if they are empty.
        return SettingsFile(file=file, section="") if file.name != "pyproject.toml" else None
    section, parsed = _INI_SECTIONS[file.name], _ini(text, file)
    if parsed.has_section(section):
        return SettingsFile(file=file, section=section, values=parsed[section])
    return SettingsFile(file=file, section="") if file.stem.endswith("pytest") else None


def _in_toml(key: str, value: str) -> str:
    """Return a value as TOML; where pytest takes TOML's own types, paths are a list."""
    return f'["{value}"]' if key in PYTHONPATH else f'"{value}"'


def _with_lines_in(text: str, section: str, lines: list[str]) -> str:
    """Return a text with lines below the header of a section."""
    header = re.compile(rf"^\[\s*{re.escape(section)}\s*\][^\n]*\n?", re.MULTILINE)
    found = header.search(text)
    if found is None:
        return text
    head, rest = text[: found.end()], text[found.end() :]
    end = "" if head.endswith("\n") else "\n"
    return "\n".join([f"{head}{end}{lines[0]}", *lines[1:], rest])


def _has_settings(text: str, file: Path, keys: list[str]) -> bool:
    """Return whether pytest would find the settings in a file with this text."""
    if file.name in _TOML_TABLES:
        values = _toml(text, file)
        tables = [_table(values, name) for name in _TOML_TABLES[file.name]]
        return any(table is not None and {*keys} <= {*table} for table in tables)
    parsed, section = _ini(text, file), _INI_SECTIONS[file.name]
    return parsed.has_section(section) and {*keys} <= {*parsed[section]}


def _table(values: Mapping[str, Any], name: str) -> Mapping[str, Any] | None:
    found: Any = values
    for key in name.split("."):
        found = found.get(key) if isinstance(found, dict) else None
    return found if isinstance(found, dict) else None


def _toml(text: str, file: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise GarlError(f"{file.name}: is no valid TOML ({error}); correct it first") from error


def _ini(text: str, file: Path) -> configparser.ConfigParser:
    parsed = configparser.ConfigParser(interpolation=None, strict=False)
    try:
        parsed.read_string(text)
    except configparser.Error as error:
        raise GarlError(f"{file.name}: cannot be read ({error}); correct it first") from error
    return parsed


def _text_of(file: Path) -> str:
    try:
        # Ends of lines stay as they are.
        with file.open(encoding="utf-8", newline="") as opened:
            return opened.read()
    except (OSError, UnicodeDecodeError) as error:
        raise GarlError(f"{file}: cannot be read ({error})") from error
