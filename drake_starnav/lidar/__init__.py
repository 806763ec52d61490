"""A scan, and what a sensor makes of the world."""
