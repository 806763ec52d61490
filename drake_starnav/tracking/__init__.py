"""Scans -> dynamic obstacles."""
