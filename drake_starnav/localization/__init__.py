"""Scans -> pose."""
