"""Obstacles that move: they are tracked in scans, certified against, and avoided."""
