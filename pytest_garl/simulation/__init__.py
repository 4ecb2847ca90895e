"""Where a landing is flown: the flight loop, its recorder and its record."""
