"""Poses, polylines, trajectories and footprints."""
