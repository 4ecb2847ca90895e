"""Judgement of flights: properties and margins, violation types, signatures, metrics."""
