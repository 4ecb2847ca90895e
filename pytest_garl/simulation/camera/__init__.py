"""What the camera sees: renderer, projection, ground, bodies, weather."""
