"""Log what the diagram's ports carry with Drake's `LogVectorOutput`, and plot it over time.

Any vector port can be logged; what a port carries as an object (here the certificate) is read by a monitor of the
simulator after each step.

Run: python scripts/examples/10_log_and_plot.py [--png FILE] [--csv FILE]
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, EventStatus
from pydrake.systems.primitives import LogVectorOutput

from drake_starnav import ArrivalMonitor, add_navigation, load_scenario
from drake_starnav.plotting import save_figure

PERIOD = 0.05  # of the logs, s
BLUE, ORANGE, GREEN = "#0072B2", "#D55E00", "#009E73"


def main(png: Path | None, csv: Path | None) -> None:
    """Drive through a room, and print, plot and write what was logged."""
    scenario = load_scenario("room")
    builder = DiagramBuilder()
    navigation = add_navigation(builder, scenario, seed=7)
    shield = navigation.shield
    assert shield is not None
    state = LogVectorOutput(navigation.station.GetOutputPort("localization.state"), builder, PERIOD)
    twist = LogVectorOutput(shield.GetOutputPort("twist_command"), builder, PERIOD)
    ranges = LogVectorOutput(navigation.station.GetOutputPort("lidar.ranges"), builder, PERIOD)
    ArrivalMonitor.AddToBuilder(builder, navigation, tolerance=0.1)
    simulator = Simulator(builder.Build())
    certified: list[bool] = []

    def monitor(root: Context) -> EventStatus:
        context = shield.GetMyContextFromRoot(root)
        certified.append(shield.GetOutputPort("certificate").Eval(context).certified)
        return EventStatus.DidNothing()

    simulator.set_monitor(monitor)
    status = simulator.AdvanceTo(30.0)
    context = simulator.get_context()
    time = state.FindLog(context).sample_times()
    v, omega = state.FindLog(context).data()[3:]
    v_command, omega_command = twist.FindLog(context).data()
    nearest = ranges.FindLog(context).data().min(axis=0) - scenario.robot.radius
    print(f"{status.message() or 'out of time'} at {context.get_time():.2f} s; {len(time)} samples of each port")
    print(f"speed off the command by {np.abs(v - v_command).mean():.3f} m/s in the mean", end="; ")
    print(f"{np.mean(certified):.1%} of the commands certified")
    print(f"nearest hit {nearest.min():.2f} m off the hull")
    if csv is not None:
        table = np.column_stack((time, v_command, v, omega_command, omega, nearest))
        np.savetxt(csv, table, fmt="%.4f", delimiter=",", header="time,v_command,v,omega_command,omega,nearest")
    if png is not None:
        figure = Figure(figsize=(8.0, 6.0), layout="constrained")
        speed, turn, clearance = figure.subplots(3, 1, sharex=True)
        for axis, command, measured in ((speed, v_command, v), (turn, omega_command, omega)):
            axis.step(time, command, where="post", color=ORANGE, label="command")
            axis.plot(time, measured, color=BLUE, label="measured")
        speed.set(ylabel="v in m/s", title="What the ports carried")
        turn.set(ylabel="omega in rad/s")
        clearance.plot(time, nearest, color=GREEN, label="nearest hit to hull")
        clearance.set(ylabel="distance in m", xlabel="time in s", ylim=(0.0, None))
        for axis in (speed, clearance):
            axis.legend(loc="best", frameon=False)
        save_figure(figure, png, legend=False)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw the logs")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="also write them as a table")
    options = parser.parse_args()
    main(options.png, options.csv)
