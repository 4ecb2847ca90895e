"""What went wrong: properties and margins, violation types, signatures, metrics."""
