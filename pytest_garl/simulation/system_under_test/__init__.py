"""The landing system in a flight: its inputs, its calls, and the validation of its commands."""
