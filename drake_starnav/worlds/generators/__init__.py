"""Worlds that are drawn at random."""
