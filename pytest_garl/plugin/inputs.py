"""What the options of a session name, read once: the saved cases, and a slot to fly again."""

from __future__ import annotations

import pytest

from pytest_garl.cases.corpus import Corpus
from pytest_garl.errors import GarlError
from pytest_garl.execution.flight_id import Slot
from pytest_garl.execution.stored_ledger import StoredSlot, read_slot
from pytest_garl.plugin.options import SLOT_ID, options_of

_CORPUS = pytest.StashKey[Corpus]()
_SLOT = pytest.StashKey[StoredSlot]()


def corpus_of(config: pytest.Config) -> Corpus:
    """Return the session's saved cases."""
    if _CORPUS not in config.stash:
        options = options_of(config)
        config.stash[_CORPUS] = Corpus(options.cases, options.map_folders)
    return config.stash[_CORPUS]


def repeated_slot_of(config: pytest.Config) -> StoredSlot | None:
    """Return the slot that ``--garl-repeat`` names, as the earlier search flew it; else None.

    Raises UsageError if the ledger of that search does not hold it, or cannot be read.
    """
    options = options_of(config)
    match = SLOT_ID.fullmatch(options.repeat)
    if match is None:
        return None
    if _SLOT not in config.stash:
        slot = Slot(generation=int(match["generation"]), index=int(match["slot"]))
        try:
            config.stash[_SLOT] = read_slot(options.folder / "ledger.sqlite", match["map"], slot)
        except GarlError as error:
            raise pytest.UsageError(f"--garl-repeat={options.repeat}: {error}") from error
    return config.stash[_SLOT]
