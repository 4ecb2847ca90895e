"""The names of the files that a run leaves in a project, unless its settings say otherwise.

Every pytest run imports this module, so it imports nothing.
"""

from __future__ import annotations

RUN_FOLDER = ".garl"
"""The folder of the ledger and of the records of flights."""
SEARCH_LEDGER = "ledger.sqlite"
"""The ledger of a search, in that folder."""
ARCHIVE = "archive-{}.json.gz"
"""The archive that the search began with, by its hash, beside the ledger."""
REPEAT_LEDGER = "repeat.sqlite"
"""The ledger of a scenario that is flown again, beside it."""
CASES_FOLDER = "scenarios/regressions"
"""The folder of the saved cases."""
