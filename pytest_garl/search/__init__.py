"""Which scenario next: the search methods, the ledger and the flight pool."""
