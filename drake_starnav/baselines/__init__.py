"""Controllers to compare with: each is one pure function of the robot's state and its surroundings."""

import drake_starnav.utils.compilation  # noqa: F401  (shows what is compiled)
