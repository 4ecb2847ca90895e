"""Reading and writing of files: atomic writes and locks, strict TOML, bounded reads."""
