"""The simulated robot and its world, which drivers can replace."""
