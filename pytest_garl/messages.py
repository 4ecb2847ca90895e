"""Text that nobody vetted, made fit for a terminal and short enough for a message."""

from __future__ import annotations

import re
import reprlib
import shlex
import sys
import unicodedata
from collections.abc import Iterable

SHOWN = 80
"""Characters of a found value that a message shows: about one line."""


def printable(text: str, *, keep: str = "\n\t") -> str:
    r"""Return ``text`` with everything that is not seen written out, as ``\x1b`` or ``\u202e``.

    These are control characters, the escape sequences that begin with one, marks that turn the
    direction of writing, and halves of characters that no terminal can encode.  What is in
    ``keep`` stays; pass an empty string for what must be one line.  The commands of build servers
    get a backslash: ``\::error`` (GitHub obeys it at the start of a line, after spaces, too) and
    ``#\#[error]`` (anywhere; also ``##vso[`` and ``##teamcity[``).
    """
    if "::" in text or "##" in text:
        text = _LOG_COMMAND.sub(lambda found: _defused(found[0]), text)
    return visible(text, keep=keep)


def visible(text: str, *, keep: str = "\n\t") -> str:
    """Write out what a terminal would obey, as ``printable`` does, and leave all else as it is."""
    if text.isprintable():
        return text
    return "".join(char if char in keep or _is_seen(char) else _written_out(char) for char in text)


def _defused(command: str) -> str:
    # Not an invisible mark: a comparison that heeds the language skips it.
    return f"\\{command}" if command.startswith(":") else "#\\#"


def _is_seen(char: str) -> bool:
    # Wide and unbreakable spaces are not "printable" for Python, but harmless.
    return char.isprintable() or unicodedata.category(char) == "Zs"


def _written_out(char: str) -> str:
    return char.encode("unicode_escape").decode("ascii")


def command(*words: object) -> str:
    """Return a command that somebody may paste into a shell, whatever its words hold."""
    return " ".join(shlex.quote(printable(str(word), keep="")) for word in words)


def shortened(text: str, limit: int = SHOWN) -> str:
    """Return one printable line of at most ``limit`` characters, cut in the middle."""
    # No more than this can be left after cutting: a file may hold a megabyte in one word.
    head = printable(text[:limit], keep="")
    tail = printable(text[-limit:], keep="")
    if len(text) <= limit and len(head) <= limit:
        return head
    side = (limit - 1) // 2
    return f"{head[: limit - 1 - side]}…{tail[len(tail) - side :]}"


def shown(value: object, limit: int = SHOWN) -> str:
    """Return the start of a value's ``repr``, whatever it is and however large."""
    try:
        return shortened(brief(value), limit)
    except (ValueError, RecursionError):
        # Python refuses to write whole numbers of more than 4300 digits.
        return f"{type(value).__name__} too long to be shown"


def listed(names: Iterable[object], limit: int = 10 * SHOWN) -> str:
    """Return names separated by commas, cut where they would fill a screen."""
    return shortened(", ".join(str(name) for name in names), limit)


def brief(value: object) -> str:
    """Return a value's ``repr`` with few of its items; raise what the value's own raises."""
    return _REPR.repr(value)


_LOG_COMMAND = re.compile(r"(?<!\S)::|##(?=\w*\[)")
_REPR = reprlib.Repr()
_REPR.maxlevel = 4
_REPR.maxstring = _REPR.maxlong = _REPR.maxother = SHOWN
_REPR.maxlist = _REPR.maxtuple = _REPR.maxdict = 8


def python_that_lacks(error: str) -> str:
    """Return which Python could not import a module, if the text of an error says that one fails.

    A module such as ``rclpy`` is often installed for another Python than the one that runs.
    """
    if "ModuleNotFoundError" not in error and "ImportError" not in error:
        return ""
    version = ".".join(str(each) for each in sys.version_info[:3])
    return f"; this is Python {version} at {sys.executable}"
