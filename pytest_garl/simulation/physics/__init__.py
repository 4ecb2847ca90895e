"""Motion of bodies: the pybullet world, the vehicle and its control, the NPCs' bodies."""
