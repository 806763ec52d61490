"""The commands of `starnav`."""
