"""A robot in MuJoCo drives through a forest: the runtime gets scans and odometry, and says the twists.

Its motors' rotors have an inertia, `armature`: without one its wheels slide. Needs `drake-starnav[simulators]`.

Run: python scripts/examples/17_drive_in_mujoco.py [--png FILE]
"""

import argparse
from pathlib import Path

import mujoco
import numpy as np

from drake_starnav import LaserScan, load_scenario, make_world
from drake_starnav.plotting import save_drive
from drake_starnav.runtime import Navigator, Odometry

MODEL = """<mujoco><option timestep="0.005" integrator="implicitfast"/><compiler angle="radian"/>
<default><geom condim="1"/><joint axis="0 1 0" armature="0.005"/><velocity kv="2" forcerange="-2 2"/></default>
<worldbody><geom type="plane" size="50 50 1"/>{stand}
<body pos="{start[0]} {start[1]} 0.05" euler="0 0 {start[2]}"><freejoint/><site name="lidar" pos="0 0 0.08"/>
<geom type="cylinder" size="{radius} 0.05" pos="0 0 0.03" mass="8.2"/>
<geom size="0.02" pos="0.15 0 -0.02995"/><geom size="0.02" pos="-0.15 0 -0.02995"/>
<body pos="0 0.16 0"><joint name="l"/><geom size="0.05" mass="0.5" condim="3"/></body>
<body pos="0 -0.16 0"><joint name="r"/><geom size="0.05" mass="0.5" condim="3"/></body></body></worldbody>
<actuator><velocity joint="l"/><velocity joint="r"/></actuator></mujoco>"""
WHEELS = np.array(((1.0, -0.16), (1.0, 0.16))) / 0.05


def main(png: Path | None) -> None:
    """Drive, and say how it went."""
    scenario = load_scenario("forest", overrides=["lidar.rate=50", "controller.rate=50"])
    world, lidar, radius = make_world(scenario.world, 0, scenario.robot.radius), scenario.lidar, scenario.robot.radius
    stand = [f'<geom type="cylinder" size="{r} 0.5" pos="{x} {y} 0.5"/>' for x, y, r in world.cylinders]
    for side, inward in zip(world.extent, ("1 0 0", "0 1 0", "-1 0 0", "0 -1 0"), strict=True):
        stand.append(f'<geom type="plane" size="50 50 1" pos="{side} {side} 0" zaxis="{inward}"/>')
    model = mujoco.MjModel.from_xml_string(MODEL.format(stand="".join(stand), start=world.start, radius=radius))
    data, hit, ranges = mujoco.MjData(model), np.zeros(360, np.int32), np.zeros(360)
    rays = np.array([(np.cos(angle), np.sin(angle), 0.0) for angle in -np.pi + np.arange(360) * np.pi / 180.0])
    navigator, trail, contacts = Navigator(scenario), [np.array(world.start[:2])], 0
    while data.time < 60.0 and np.hypot(*(trail[-1] - world.goal)) > scenario.simulation.goal_tolerance:
        mujoco.mj_forward(model, data)
        at, R = data.site_xpos[0], data.site_xmat[0].reshape(3, 3)
        mujoco.mj_multiRay(model, data, at, (rays @ R.T).ravel(), None, 1, 1, hit, ranges, None, 360, lidar.range_max)
        scan = LaserScan(data.time, ranges=np.where(ranges < 0.0, np.inf, ranges), **lidar.scan_fields)
        odom = Odometry(data.time, at[0], at[1], np.arctan2(R[1, 0], R[0, 0]), R[:, 0] @ data.qvel[:3], data.qvel[5])
        data.ctrl[:] = WHEELS @ navigator.step(data.time, [scan], [odom], world.goal).twist
        mujoco.mj_step(model, data, 4)
        trail.append(data.qpos[:2].copy())
        contacts += sum(min(each.geom) > 0 for each in data.contact)  # 0 is the floor
    print(f"{np.hypot(*(trail[-1] - world.goal)):.2f} m from the goal after {data.time:.1f} s; {contacts} contacts")
    if png is not None:
        save_drive(world, np.array(trail), "A drive in MuJoCo", png)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
