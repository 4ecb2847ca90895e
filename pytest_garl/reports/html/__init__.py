"""A run as pages for people: an index, and a page for each kind of violation.

``run_page.py``, ``kind_page.py`` and ``flight_view.py`` turn the ledger, the cases and the records
of flights into plain values; the templates only show them.  ``report.py`` puts them together.
"""

MOST_FILMS = 10
"""Kinds with a film: a film takes some seconds on a core, and up to a megabyte."""
