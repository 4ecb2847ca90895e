"""The record of a flight, its file, and the figures on which it is judged."""
