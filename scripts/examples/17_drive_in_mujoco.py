"""A robot in MuJoCo drives through a forest: the runtime gets scans and odometry, and says the twists.

Its motors' rotors have an inertia (`armature`): without one the contacts let the wheels slide, and the robot swerves.
Needs `pip install drake-starnav[simulators]`.

Run: python scripts/examples/17_drive_in_mujoco.py [--png FILE]
"""

import argparse
from pathlib import Path

import mujoco
import numpy as np

from drake_starnav import LaserScan, load_scenario, make_world
from drake_starnav.plotting import draw_goal, save_figure, world_axes
from drake_starnav.runtime import Navigator, Odometry

MODEL = """<mujoco><option timestep="0.005" integrator="implicitfast"/>
<default><joint axis="0 1 0" armature="0.005"/></default><worldbody><geom type="plane" size="50 50 1"/>
{obstacles}
<body name="base" pos="{x} {y} 0.05" euler="0 0 {yaw}"><freejoint/><site name="lidar" pos="0 0 0.08"/>
<geom type="cylinder" size="{radius} 0.05" pos="0 0 0.03" mass="8.2" group="1"/>
<geom type="sphere" size="0.02" pos="0.15 0 -0.02995" condim="1" priority="1" group="1"/>
<geom type="sphere" size="0.02" pos="-0.15 0 -0.02995" condim="1" priority="1" group="1"/>
<body pos="0 0.16 0"><joint name="l"/><geom size="0.05" mass="0.5" group="1"/></body>
<body pos="0 -0.16 0"><joint name="r"/><geom size="0.05" mass="0.5" group="1"/></body></body></worldbody>
<actuator><velocity joint="l" kv="2" forcerange="-2 2"/><velocity joint="r" kv="2" forcerange="-2 2"/></actuator>
</mujoco>"""
OBSTACLES = np.array((1, 0, 0, 0, 0, 0), np.uint8)


def main(png: Path | None) -> None:
    """Drive, and say how it went."""
    scenario = load_scenario("forest")
    world, lidar, trail, contacts = make_world(scenario.world, 0, scenario.robot.radius), scenario.lidar, [], 0
    obstacles = "".join(f'<geom type="cylinder" size="{r} 0.5" pos="{x} {y} 0.5"/>' for x, y, r in world.cylinders)
    x0, y0, x1, y1 = world.extent
    for x, y, *inward in ((x0, y0, 1, 0), (x0, y0, 0, 1), (x1, y1, -1, 0), (x1, y1, 0, -1)):
        obstacles += f'<geom type="plane" size="50 50 1" pos="{x} {y} 0" zaxis="{inward[0]} {inward[1]} 0"/>'
    values = {"obstacles": obstacles, "radius": scenario.robot.radius, "yaw": np.degrees(world.start[2])}
    model = mujoco.MjModel.from_xml_string(MODEL.format(x=world.start[0], y=world.start[1], **values))
    data, navigator, hit, seen = mujoco.MjData(model), Navigator(scenario), np.zeros(360, np.int32), np.zeros(360)
    rays = np.array([(np.cos(angle), np.sin(angle), 0.0) for angle in -np.pi + np.arange(360) * np.pi / 180.0])
    mujoco.mj_forward(model, data)
    while data.time < 60.0 and np.hypot(*(data.qpos[:2] - world.goal)) > scenario.simulation.goal_tolerance:
        (x, y, _, w, *_, z), (vx, vy, *_, omega), scans = data.qpos[:7], data.qvel[:6], []
        yaw = 2.0 * np.arctan2(z, w)
        trail.append((x, y))
        if len(trail) % 5 in (1, 4):  # 20 Hz
            turned, place = (rays @ data.site_xmat[0].reshape(3, 3).T).ravel(), data.site_xpos[0]
            mujoco.mj_multiRay(model, data, place, turned, OBSTACLES, 1, 1, hit, seen, None, 360, lidar.range_max)
            scans = [LaserScan(data.time, ranges=np.where(seen < 0.0, np.inf, seen), **lidar.scan_fields)]
        odometry = Odometry(data.time, x, y, yaw, vx * np.cos(yaw) + vy * np.sin(yaw), omega)
        v, turning = navigator.step(data.time, scans, [odometry], world.goal).twist
        data.ctrl[:] = (v - 0.16 * turning) / 0.05, (v + 0.16 * turning) / 0.05
        mujoco.mj_step(model, data, 4)
        roots = (model.body_rootid[model.geom_bodyid[each.geom]] for each in data.contact if 0 not in each.geom)
        contacts += sum(a != b for a, b in roots)
    away = np.hypot(*(data.qpos[:2] - world.goal))
    print(f"{away:.2f} m from the goal after {data.time:.1f} s; {contacts} contacts")
    if png is not None:
        figure, axis = world_axes(world, "A drive in MuJoCo")
        axis.plot(*np.array(trail).T, color="#D55E00", label="driven")
        draw_goal(axis, world.goal)
        save_figure(figure, png)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
