"""Files, snapshots, wall-clock times and shipped resources: nothing of the domain."""
