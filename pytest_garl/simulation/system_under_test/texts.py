"""Texts of a landing system's making: of bounded length, the same in every process."""

from __future__ import annotations

import re
from collections.abc import Callable

from pytest_garl.messages import SHOWN, brief, printable

MESSAGE_CHARS = 1_000
"""How much of an exception's message is kept."""
TRACEBACK_CHARS = 20_000
NAME_CHARS = 80
"""How much of a name is kept: it becomes part of signatures and of the names of files."""

_ADDRESS = re.compile(r"\bat 0x[0-9A-Fa-f]{6,}")


def cut(text: str, limit: int) -> str:
    """Return plain text of at most ``limit`` characters and a note that says what was cut.

    Addresses differ in each process and are left out.  Control characters, and what cannot be
    written as UTF-8, are escaped.
    """
    whole = str.__len__(text)
    # The slot of the class itself: a subclass of str may do as it likes.
    kept = printable(str.__getitem__(text, slice(0, limit)))
    note = f"... (cut, {whole} characters)" if whole > limit else ""
    return _ADDRESS.sub("at 0x...", kept) + note


def cut_middle(text: str, limit: int) -> str:
    """Cut a text in its middle: of a traceback both ends matter."""
    if len(text) <= limit:
        return cut(text, limit)
    half = limit // 2
    note = f"\n... (cut, {len(text)} characters)\n"
    return cut(text[:half], half) + note + cut(text[-half:], half)


def class_name(kind: type) -> str:
    """Return the name of a class as part of a signature: a word of at most 80 characters."""
    name: str = type.__dict__["__name__"].__get__(kind)
    return identifier_from(name)


def identifier_from(name: str) -> str:
    """Return a name without what no identifier has, cut where a file's name would be too long."""
    return re.sub(r"[^\w.<>-]", "_", cut(name, NAME_CHARS))[:NAME_CHARS]


def text_from(tell: Callable[[], str], limit: int, otherwise: str) -> str:
    """Return what ``tell`` returns, cut; ``otherwise`` and the error's name if it raises."""
    try:
        return cut(tell(), limit)
    except Exception as error:  # noqa: BLE001 (code of a landing system, which raises what it likes)
        return f"{otherwise} raised {class_name(type(error))}"


def shown(value: object) -> str:
    """Return the start of a value's repr, whatever the value is and whatever its repr raises."""
    name = class_name(type(value))
    text = text_from(lambda: brief(value), 10 * SHOWN, f"<{name}>, whose repr()")
    return text if len(text) <= SHOWN else text[: SHOWN - 3] + "..."
