"""Keys that had another name in drafts: the message about such an unknown key suggests the name it has now."""

RENAMED = {
    "movers": "obstacles",
    "planner.closer_look": "inspection_detour",
    "controller.max_swerve": "free_heading_range",
    "obstacles.sidestep": "modulation",
    "world.min_movers": "min_moving_obstacles",
    "world.max_movers": "max_moving_obstacles",
}
"""Section, or section and key -> the name now. An old key is never read."""


def name_now(key: str) -> str:
    """What to look for among the valid names in place of an unknown section, or "section.key"; without the section."""
    return RENAMED.get(key, key.rpartition(".")[2])
