"""Controllers to compare with: each is one pure function of the robot's state and its surroundings, and a planner."""
