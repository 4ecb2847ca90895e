"""Texts from a landing system's code: shortened, escaped, and equal in every process."""

from __future__ import annotations

import re
from collections.abc import Callable

from pytest_garl.messages import SHOWN, brief, printable

MESSAGE_CHARS = 1_000
"""Longest message of an exception in a record."""
TRACEBACK_CHARS = 20_000
NAME_CHARS = 80
"""Longest name in a record: names become part of signatures and of file names."""

_ADDRESS = re.compile(r"\bat 0x[0-9A-Fa-f]{6,}")


def cut(text: str, limit: int) -> str:
    """Return the first ``limit`` characters of a text, and a note if it was cut.

    Memory addresses are left out, because they differ in each process.  Control characters and
    characters that UTF-8 cannot encode are escaped.
    """
    whole = str.__len__(text)
    # The methods of str itself, because a subclass may override them with any code.
    kept = printable(str.__getitem__(text, slice(0, limit)))
    note = f"... (cut, {whole} characters)" if whole > limit else ""
    return _ADDRESS.sub("at 0x...", kept) + note


def cut_middle(text: str, limit: int) -> str:
    """Cut a text in its middle, such as a traceback, of which both ends matter."""
    if len(text) <= limit:
        return cut(text, limit)
    half = limit // 2
    note = f"\n... (cut, {len(text)} characters)\n"
    return cut(text[:half], half) + note + cut(text[-half:], half)


def class_name(kind: type) -> str:
    """Return the name of a class as it appears in signatures, at most 80 characters."""
    name: str = type.__dict__["__name__"].__get__(kind)
    return identifier_from(name)


def identifier_from(name: str) -> str:
    """Return a name with other characters replaced by ``_``, short enough for a file name."""
    return re.sub(r"[^\w.<>-]", "_", cut(name, NAME_CHARS))[:NAME_CHARS]


def text_from(make_text: Callable[[], str], limit: int, fallback: str) -> str:
    """Return the result of ``make_text``, cut; ``fallback`` and the error's name if it raises."""
    try:
        return cut(make_text(), limit)
    except Exception as error:  # noqa: BLE001 (code of a landing system may raise anything)
        return f"{fallback} raised {class_name(type(error))}"


def shown_foreign(value: object) -> str:
    """Return the start of a value's repr; an error in its repr is caught."""
    name = class_name(type(value))
    text = text_from(lambda: brief(value), 10 * SHOWN, f"<{name}>, whose repr()")
    return text if len(text) <= SHOWN else text[: SHOWN - 3] + "..."
