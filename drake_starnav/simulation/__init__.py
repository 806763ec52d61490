"""One scenario and one seed -> one trial: its outcome, its metrics and, on request, its recording."""

from drake_starnav.simulation.monitors import add_collision_monitor
from drake_starnav.simulation.robots import RobotTrial, run_robots
from drake_starnav.simulation.run import Observer, run_trial
from drake_starnav.simulation.trial import Trial, omniscient_path, trial_record

__all__ = [
    "Observer",
    "RobotTrial",
    "Trial",
    "add_collision_monitor",
    "omniscient_path",
    "run_robots",
    "run_trial",
    "trial_record",
]
