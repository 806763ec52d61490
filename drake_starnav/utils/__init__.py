"""Files, snapshots, wall-clock times and shipped resources: independent of the domain."""
