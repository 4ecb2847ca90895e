"""Which scenario is flown next: the search methods and what they share."""
