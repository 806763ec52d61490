"""Record a diagram of your own as one HTML file that opens offline: here, a robot that patrols between four posts.

`Recorder` is what the command line records with. It draws into a Meshcat of its own, and its page has camera buttons,
a legend and a caption.

Run: python scripts/examples/12_record_your_diagram.py [--html FILE] [--png FILE]
"""

import argparse
import logging
import tempfile
from pathlib import Path

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, EventStatus, LeafSystem
from pydrake.systems.primitives import LogVectorOutput

from drake_starnav import Parts, Recorder, World, add_navigation, load_scenario
from drake_starnav.plotting import Motion

ROUND = np.array([(2.5, 0.0), (2.5, 2.5), (0.0, 2.5), (0.0, 0.0)])
NEAR, DURATION = 0.4, 30.0
"""A place counts as visited from this near, m; time of the patrol, s."""


class Patrol(LeafSystem):
    """The goal: one place after the other, as soon as the robot is near."""

    def __init__(self) -> None:
        super().__init__()
        self._pose = self.DeclareVectorInputPort("pose", 3)
        self._visited = self.DeclareDiscreteState(1)
        self.DeclareVectorOutputPort("goal", 2, self._calc_goal, {self.discrete_state_ticket(self._visited)})
        self.DeclarePeriodicDiscreteUpdateEvent(0.1, 0.0, self._update)

    def _calc_goal(self, context, output) -> None:
        output.SetFromVector(ROUND[int(context.get_discrete_state(self._visited).value()[0]) % len(ROUND)])

    def _update(self, context, values) -> EventStatus:
        visited = context.get_discrete_state(self._visited).value()[0]
        distance = np.hypot(*(self._pose.Eval(context)[:2] - ROUND[int(visited) % len(ROUND)]))
        values.set_value(self._visited, [visited + (distance < NEAR)])
        return EventStatus.Succeeded()


def main(html: Path, png: Path | None) -> None:
    """Patrol, and write the recording and a still of its end."""
    logging.getLogger("drake").setLevel(logging.WARNING)  # Meshcat would name its port
    posts = np.array([(x, y, 0.3) for x in (0.6, 1.9) for y in (0.6, 1.9)])
    world = World("patrol", (0.0, 0.0, 0.0), tuple(ROUND[0]), cylinders=posts, bounds=(-1.0, -1.0, 3.5, 3.5))
    scenario = load_scenario("room")
    builder = DiagramBuilder()
    patrol = builder.AddNamedSystem("patrol", Patrol())
    navigation = add_navigation(builder, scenario, Parts(world, goal=patrol))
    builder.Connect(navigation.localization("pose"), patrol.GetInputPort("pose"))
    log = LogVectorOutput(navigation.localization("pose"), builder, 0.05)
    recorder = Recorder.AddToBuilder(builder, navigation, html, scenario)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(DURATION)
    record = log.FindLog(simulator.get_context())
    visited = int(patrol.GetMyContextFromRoot(simulator.get_context()).get_discrete_state().value()[0])
    recorder.finish((f"{visited} places visited",), Motion(record.sample_times(), record.data().T))
    print(f"{visited} places visited in {DURATION:g} s; a page of {html.stat().st_size / 1e6:.1f} MB")
    if png is not None:
        recorder.save(png, DURATION, width=800)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--html", type=Path, metavar="FILE", help="keep the recording")
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw the end of the patrol")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        main(options.html or Path(folder) / "patrol.html", options.png)
