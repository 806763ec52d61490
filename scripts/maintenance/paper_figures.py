"""The figures of docs/paper.md: trajectories (Fig. 6), a drive out of a dead end (Fig. 7)."""

from pathlib import Path
from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem

from drake_starnav.evaluation.report.figures import OBSTACLES, render_svg
from drake_starnav.evaluation.report.results import Results
from drake_starnav.geometry.trajectory import Motion
from drake_starnav.loading import load_scenario
from drake_starnav.navigation import Navigation
from drake_starnav.navigation.robot import robot_world
from drake_starnav.robot.motion import BrakingMotion
from drake_starnav.scenario.schema import Scenario
from drake_starnav.simulation.run import run_trial
from drake_starnav.visualization.world_figure import draw_world, make_figure

SIDE_BY_SIDE = ("dsm", "foa", "foa_roadmap", "star_paper", "star", "grid_astar")
"""Methods of Fig. 6: the paper's four from left to right, and two of ours."""
DRIVES = 5
"""Trials that it shows in each world."""
SEED = 0
"""Of Fig. 7."""
PERIOD = 0.1
"""Of the samples of Fig. 7, s."""
SPEEDS = {"desired": "#D55E00", "certified": "#0072B2", "driven": "0.2"}
"""Colours of Fig. 7."""


def draw_figures(results: Results, folder: Path) -> None:
    """Draw Fig. 6 and 7 into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "trajectories.svg").write_text(render_svg(trajectories(results)), encoding="utf-8")
    (folder / "dead_end.svg").write_text(render_svg(dead_end()), encoding="utf-8")


def trajectories(results: Results) -> Any:
    """Fig. 6: the paths of the first trials, a row for each world and a panel for each method."""
    methods = [method for method in SIDE_BY_SIDE if method in results.methods]
    figure = make_figure(1.7 * len(results.scenarios))
    grid = figure.subplots(len(results.scenarios), len(methods), squeeze=False)
    for scenario, row in zip(results.scenarios, grid, strict=True):
        for method, axes in zip(methods, row, strict=True):
            case = results.of(scenario, method)
            reached = sum(record["outcome"] == "reached" for record in case)
            world = robot_world(results.scenario(case[0]), case[0]["seed"])
            draw_world(axes, world, OBSTACLES)
            for record in case[:DRIVES]:
                if path := record.get("path"):
                    arrived = record["outcome"] == "reached"
                    axes.plot(*np.array(path).T, color="#0072B2" if arrived else "#D55E00", linewidth=1.1)
                    axes.plot(*path[0], marker="o", color="0.2", markersize=2.5)
                    axes.plot(*path[-1], marker="*" if arrived else "x", color="0.2", markersize=5)
            x0, y0, x1, y1 = world.extent
            axes.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal")
            axes.set_axis_off()
            ran = sum("time_s" in record for record in case)
            said = f"{reached} of {ran}" if ran else "no expression"
            axes.set_title(f"{method}\n{said}", fontsize=9, parse_math=False)
    return figure


class DriveLog(LeafSystem):
    """Logs speeds and the certificate of one trial; an `Observer` of it.

    Attributes:
        rows: time, s; desired, certified and driven speed, m/s; length of the certified braking motion, m; 1 if the
            last command passed the certificates, else 0; position x, y, m.
    """

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[tuple[float, ...]] = []

    def add_to(self, builder: DiagramBuilder, navigation: Navigation, scenario: Scenario) -> None:
        """Connect it to what it logs."""
        controller, driven, certificate = navigation.controller, navigation.twist_command, navigation.certificate
        assert controller is not None and driven is not None and certificate is not None
        builder.AddNamedSystem("drive_log", self)
        for port in (controller.GetOutputPort("desired_twist"), driven, navigation.localization("state")):
            builder.Connect(port, self.DeclareVectorInputPort(port.get_name(), port.size()))
        builder.Connect(certificate, self.DeclareAbstractInputPort("certificate", Value(BrakingMotion.none())))
        self.DeclarePeriodicPublishEvent(PERIOD, 0.0, self._note)

    def start(self) -> None:
        """Nothing is to be done."""

    def finish(self, lines: tuple[str, ...], motion: Motion) -> None:
        """Nothing is to be done."""

    def _note(self, context: Context) -> None:
        desired, certified, state = (self.get_input_port(k).Eval(context) for k in range(3))
        braking = self.get_input_port(3).Eval(context)
        length = float(np.hypot(*np.diff(braking.path[:, :2], axis=0).T).sum())
        row = context.get_time(), desired[0], certified[0], state[3], length, float(braking.certified), *state[:2]
        self.rows.append(row)


def dead_end() -> Any:
    """Fig. 7: speeds and certificate over the time of a drive of `star` in `paper_room`; in the pocket shaded."""
    scenario, log = load_scenario("paper_room"), DriveLog()
    run_trial(scenario, seed=SEED, observer=log)
    world = robot_world(scenario, SEED)
    times, desired, certified, driven, braking, passed, x, y = np.array(log.rows).T
    sides = sorted(world.polygons[k][:, 0].mean() for k in (2, 6))
    front, back = world.polygons[1][:, 1].max(), world.polygons[5][:, 1].mean()
    inside = (sides[0] < x) & (x < sides[1]) & (front < y) & (y < back)
    figure = make_figure(3.6)
    room, speeds, certificate = figure.subplots(1, 3, width_ratios=(0.8, 2.0, 2.0))
    draw_world(room, world, OBSTACLES)
    room.plot(x, y, color="#0072B2")
    room.plot(x[inside], y[inside], color="#D55E00")
    room.plot(*world.start[:2], "o", color="0.2")
    room.plot(*world.goal, "*", color="0.2", markersize=9)
    x0, y0, x1, y1 = world.extent
    room.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal")
    room.set_axis_off()
    for name, values in (("desired", desired), ("certified", certified), ("driven", driven)):
        speeds.plot(times, values, color=SPEEDS[name], linewidth=1.0, label=name)
    certificate.plot(times, 1e3 * braking, color="#0072B2", linewidth=1.0)
    refused = times[passed == 0.0]
    certificate.plot(refused, np.zeros(len(refused)), "|", color="#D55E00")
    speeds.legend(frameon=False, ncols=3, loc="upper center", fontsize=8)
    speeds.set(ylabel="speed, m/s", xlabel="time, s", ylim=(min(0.0, driven.min()) - 0.02, 0.5))
    certificate.set(ylabel="certified way to a stop, mm", xlabel="time, s")
    for axes in (speeds, certificate):
        axes.fill_between(times, 0, 1, where=inside, transform=axes.get_xaxis_transform(), color="#D55E00", alpha=0.15)
        axes.spines[["top", "right"]].set_visible(False)
    return figure
