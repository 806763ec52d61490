"""Lidar navigation through unknown clutter, as Drake systems: star-shaped roadmap and modulation."""
