"""The systems that would run on the robot."""
