"""The simulated camera: renderer, projection, ground, bodies, weather."""
