"""Recordings of runs: one HTML file that opens offline, and stills and clips of it."""
