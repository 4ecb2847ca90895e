"""Studies: they write the tables of the docs."""
