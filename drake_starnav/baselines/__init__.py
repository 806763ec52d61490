"""What to compare with: controllers, each a pure function of the robot's state and its surroundings, and a planner."""
