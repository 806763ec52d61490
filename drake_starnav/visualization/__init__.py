"""Pictures of worlds and runs: in Meshcat, in recordings that open offline, in figures."""
