"""The autopilot that ships: what a companion program commands by its messages."""
