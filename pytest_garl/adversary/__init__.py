"""Who interferes: the policies that steer dynamic objects."""
