"""Who interferes: the policies that steer the NPCs."""
