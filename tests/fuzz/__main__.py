"""``python -m tests.fuzz [FILES OF EACH KIND [SEED]]``."""

from __future__ import annotations

import sys

from tests.fuzz.campaign import main

sys.exit(1 if main(*(int(number) for number in sys.argv[1:])) else 0)
