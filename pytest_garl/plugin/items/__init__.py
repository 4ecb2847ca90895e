"""Which test items there are, what each flies, and what its test reads and asserts."""
