"""Files, snapshots, wall-clock times, compilation and shipped resources: independent of the domain."""
