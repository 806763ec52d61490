"""Worlds that are read from files or written down."""
