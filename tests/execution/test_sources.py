"""The sources of a landing system are read from its imports, not from the loaded modules."""

from __future__ import annotations

import importlib
import itertools
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.errors import LandingSystemError
from pytest_garl.execution.sources import data_files, source_hashes, sources_sha256

_NUMBERS = itertools.count()
STACK = {
    "__init__.py": "",
    "lander.py": "import json, numpy\nfrom {0}.planning import path\nclass Lander: pass\n",
    "planning/__init__.py": "from . import path\n",
    "planning/path.py": "from ..maths import turn as _turn\n",
    "maths.py": "def turn():\n    from {0} import late\n",
    "late.py": "import {0}.deep.deeper\n",
    "deep/deeper.py": "import pytest, pytest_garl\n",
    "other.py": "class Other: pass\n",
    "test_lander.py": "from {0}.lander import Lander\n",
}
SOURCES = {
    "__init__.py",
    "lander.py",
    "planning/__init__.py",
    "planning/path.py",
    "maths.py",
    "late.py",
    "deep/deeper.py",
}
MakePackage = Callable[[], tuple[Path, str]]


@pytest.fixture
def make_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> MakePackage:
    """Return a function that writes STACK as a new package, and returns its folder and name."""

    def make() -> tuple[Path, str]:
        name = f"stack_{next(_NUMBERS)}"
        folder = tmp_path / name
        for file, text in STACK.items():
            path = folder / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text.format(name))
        monkeypatch.syspath_prepend(str(tmp_path))
        return folder, name

    return make


def lander(name: str) -> Any:
    return importlib.import_module(f"{name}.lander").Lander


def test_sources_follow_imports_anywhere_in_a_module(make_package: MakePackage) -> None:
    _, name = make_package()
    assert {file for file, _ in source_hashes(lander(name))} == {
        f"{name}/{file}" for file in SOURCES
    }
    assert f"{name}.late" not in sys.modules


@pytest.mark.parametrize("file", sorted(SOURCES))
def test_each_source_changes_the_hash(make_package: MakePackage, file: str) -> None:
    folder, name = make_package()
    system = lander(name)
    before = sources_sha256(system)
    assert sources_sha256(system) == before
    (folder / file).write_text((folder / file).read_text() + "# changed\n")
    assert sources_sha256(system) != before


@pytest.mark.parametrize("file", ["other.py", "test_lander.py"])
def test_hash_ignores_modules_that_are_not_imported(make_package: MakePackage, file: str) -> None:
    folder, name = make_package()
    system = lander(name)
    before = sources_sha256(system)
    importlib.import_module(f"{name}.{file.removesuffix('.py')}")
    importlib.import_module(f"{name}.late")
    (folder / file).write_text("changed = True\n")
    assert sources_sha256(system) == before


def test_sources_include_modules_of_the_same_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The modules are in no package, as in the README."""
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "alone_landing.py").write_text("import alone_helper\nclass Alone: pass\n")
    helper = tmp_path / "alone_helper.py"
    helper.write_text("speed = 1\n")
    system = importlib.import_module("alone_landing").Alone
    assert [file for file, _ in source_hashes(system)] == ["alone_helper.py", "alone_landing.py"]
    before = sources_sha256(system)
    helper.write_text("speed = 2\n")
    assert sources_sha256(system) != before


def test_data_folder_means_all_files_in_it(tmp_path: Path) -> None:
    for name in ("model/a.bin", "model/deep/b.bin", "one.txt", "another.txt"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(name)
    found = data_files(["model", "one.txt"], tmp_path)
    assert [*found] == ["model/a.bin", "model/deep/b.bin", "one.txt"]
    with pytest.raises(LandingSystemError, match=r"there is no 'gone\.txt'"):
        data_files(["gone.txt"], tmp_path)
