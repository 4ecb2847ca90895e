"""Load a module of a foreign repository with stand-ins for what it imports.

The stand-ins are seen by that module only: nothing is put into ``sys.modules``.
"""

from __future__ import annotations

import ast
import builtins
import warnings
from collections.abc import Collection, Mapping
from types import ModuleType
from typing import Any

from lab.foreign.repository import ForeignCodeError


def changed(source: str, changes: Mapping[str, str]) -> str:
    """Return a source with texts replaced, each of which it must hold exactly once."""
    for old, new in changes.items():
        if (found := source.count(old)) != 1:
            raise ForeignCodeError(f"text to change: found {found} times, expected once: {old!r}")
        source = source.replace(old, new)
    return source


def with_print_calls(source: str) -> str:
    """Turn the print statements of Python 2 into calls, as its own tool 2to3 does."""
    with warnings.catch_warnings():
        # 2to3 is deprecated because it does not read the newest syntax; this syntax is old.
        warnings.simplefilter("ignore")
        from lib2to3.refactor import RefactoringTool

        tool = RefactoringTool(["lib2to3.fixes.fix_print"])
        return str(tool.refactor_string(f"{source}\n", "foreign"))


def selected(source: str, names: Collection[str]) -> str:
    """Return the imports and those assignments, functions and classes that ``names`` lists."""
    tree = ast.parse(source)
    kept = [each for each in tree.body if _is_selected(each, names)]
    return ast.unparse(ast.Module(body=kept, type_ignores=[]))


def _is_selected(statement: ast.stmt, names: Collection[str]) -> bool:
    if isinstance(statement, ast.Import | ast.ImportFrom):
        return True
    if isinstance(statement, ast.Assign):
        return any(isinstance(each, ast.Name) and each.id in names for each in statement.targets)
    return getattr(statement, "name", None) in names


def module_with(name: str, **values: Any) -> ModuleType:
    """Return a module with the given attributes, to stand in for one that is not there."""
    module = ModuleType(name)
    module.__dict__.update(values)
    return module


def run_module(
    source: str,
    *,
    name: str,
    file: str,
    stand_ins: Mapping[str, Any],
) -> ModuleType:
    """Execute a source as a module and return it.

    ``stand_ins`` are what its imports of these names give, dotted names included; its prints are
    silent.
    """

    def import_(
        wanted: str, known: Any = None, local: Any = None, fromlist: Any = (), level: int = 0
    ) -> Any:
        root = wanted.partition(".")[0]
        if wanted in stand_ins or root in stand_ins:
            return stand_ins[wanted if fromlist or root not in stand_ins else root]
        return builtins.__import__(wanted, known, local, fromlist, level)

    module = ModuleType(name)
    values = {**vars(builtins), "__import__": import_, "print": lambda *_, **__: None}
    module.__dict__.update(__name__=name, __file__=file, __builtins__=values)
    exec(compile(source, file, "exec"), module.__dict__)
    return module
