"""Poses, polylines, trajectories, ray casting, plane slices and meshes."""

import drake_starnav.utils.compilation  # noqa: F401  (shows what is compiled)
