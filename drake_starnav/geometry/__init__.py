"""Poses, polylines, trajectories, ray casting, plane slices and meshes."""
