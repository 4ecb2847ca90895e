"""Who interferes: the policies that move the NPCs."""
