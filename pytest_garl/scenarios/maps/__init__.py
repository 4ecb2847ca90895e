"""Maps: what lies and stands where a landing is flown."""
