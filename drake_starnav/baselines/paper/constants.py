"""What the paper leaves open: constants without a printed value, chosen by `scripts/experiments/tune_baselines.py`.

docs/baselines.md lists for each what is printed, what was tried and how much depends on it.
"""

RHO = 0.035
"""rho of the blend with the nearest point, eq. (combine), m."""
MARGIN = 0.0
"""What the radius r of the same equation exceeds the robot's radius by, m."""
SIGMA = 2.0
"""Exponent of Gamma, eq. (eigenvalues)."""
RANGE = 5.0
"""Largest range of the lidar that is used, m: farther points count as no return."""
EPS = 0.5
"""eps of DBSCAN, m."""
MIN_SAMPLES = 3
"""min_samples of DBSCAN."""
ARRIVAL = 0.2
"""A short-term goal this near is reached, m."""
STUCK_DISTANCE = 0.15
"""The robot is stuck when it has not moved this far, m, ..."""
STUCK_TIME = 5.0
"""... in this time, s."""
SPEED = 0.4
"""Largest speed, m/s: on average that of the paper's robot."""
