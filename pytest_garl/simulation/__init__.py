"""Where it flies: the world, the vehicle, the camera, the flight."""
