"""The search methods, which choose the next scenarios, and the code that they share."""
