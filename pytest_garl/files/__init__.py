"""How files are read and written: atomic writes and locks, strict TOML, bounded reads."""
