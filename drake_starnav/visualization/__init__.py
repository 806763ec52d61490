"""Draw worlds and runs in Meshcat, in recordings that open offline, and in figures."""
