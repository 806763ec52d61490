"""Keys that had another name in drafts: the message about such an unknown key suggests the name it has now."""

RENAMED = {
    "movers": "obstacles",
    "world.min_movers": "moving_obstacles",
    "world.max_movers": "moving_obstacles",
    "world.timeout": "simulation.timeout",
}
"""Section, or section and key -> the name now, dotted if it is in another section. An old key is never read."""


def name_now(key: str) -> str:
    """What to look for among the valid names in place of an unknown section or "section.key", as in `RENAMED`."""
    return RENAMED.get(key, key.rpartition(".")[2])
