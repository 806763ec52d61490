"""A TurtleBot3 in PyBullet drives among posts: its published URDF says what it covers and where its lidar is.

Needs `pip install pybullet`, and the URDF of `ros-jazzy-turtlebot3-description` in the folder that TURTLEBOT3 names.

Run: python scripts/examples/20_drive_a_turtlebot_in_pybullet.py [--png FILE]
"""

import argparse
import os
import re
import tempfile
from pathlib import Path

import numpy as np
import pybullet as b

from drake_starnav import LaserScan, World, parse_scenario
from drake_starnav.plotting import save_drive
from drake_starnav.runtime import Navigator, Odometry

URDF = Path(os.environ.get("TURTLEBOT3", "/opt/ros/jazzy/share/turtlebot3_description")) / "urdf/turtlebot3_burger.urdf"
POSTS = np.array([(0.9, 0.1, 0.1), (1.5, -0.6, 0.15), (1.6, 0.7, 0.15), (2.3, 0.0, 0.1)])
DECLARED = """robot: {{model: {file}, radius: 0, max_speed: 0.22, max_acceleration: 0.5, max_yaw_rate: 1.5}}
lidar: {{frame: base_scan, rate: 5, range_min: 0.12, range_max: 3.5}}
controller: {{rate: 50}}"""


def main(png: Path | None) -> None:
    """Drive, and say how it went."""
    b.connect(b.DIRECT)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "turtlebot3.urdf"
        file.write_text(re.sub(r"(?s)<visual>.*?</visual>|\$\{namespace\}", "", URDF.read_text()))
        navigator = Navigator(parse_scenario(DECLARED.format(file=file), name="turtlebot3"))
        robot = b.loadURDF(str(file), flags=b.URDF_MERGE_FIXED_LINKS)
    b.setGravity(0.0, 0.0, -9.81)
    b.setPhysicsEngineParameter(fixedTimeStep=0.02, numSubSteps=10)
    floor = b.createMultiBody(0, b.createCollisionShape(b.GEOM_PLANE))
    for x, y, r in POSTS:
        b.createMultiBody(0, b.createCollisionShape(b.GEOM_CYLINDER, r, height=1.0), -1, (x, y, 0.5))
    wheels = [k for k in range(b.getNumJoints(robot)) if b"wheel" in b.getJointInfo(robot, k)[1]]
    (mount,), lidar, trail, contacts = navigator.mounts, navigator.scenario.lidar, [np.zeros(2)], 0
    angles, span = lidar.angle_min + lidar.angle_increment * np.arange(lidar.beams), lidar.range_max - lidar.range_min
    world = World("posts", (0.0, 0.0, 0.0), (3.2, 0.1), cylinders=POSTS)
    while len(trail) < 3000 and np.hypot(*(trail[-1] - world.goal)) > navigator.scenario.simulation.goal_tolerance:
        (x, y, _), turn = b.getBasePositionAndOrientation(robot)
        (vx, vy, _), (*_, omega) = b.getBaseVelocity(robot)
        yaw, time, scans = b.getEulerFromQuaternion(turn)[2], 0.02 * (len(trail) - 1), []
        if len(trail) % 10 == 1:  # 5 Hz
            ray = np.column_stack((np.cos(angles + yaw), np.sin(angles + yaw), np.zeros(len(angles))))
            place = np.array((x, y, 0.18)) + mount.x * ray[len(ray) // 2]
            hits = b.rayTestBatch(place + lidar.range_min * ray, place + lidar.range_max * ray)
            ranges = np.array([lidar.range_min + hit[2] * span if hit[2] < 1.0 else np.inf for hit in hits])
            scans = [LaserScan(time, ranges=ranges, **lidar.scan_fields)]
        odometry = Odometry(time, x, y, yaw, vx * np.cos(yaw) + vy * np.sin(yaw), omega)
        v, omega = navigator.step(time, scans, [odometry], world.goal).twist
        speeds = (v - 0.08 * omega) / 0.033, (v + 0.08 * omega) / 0.033
        b.setJointMotorControlArray(robot, wheels, b.VELOCITY_CONTROL, targetVelocities=speeds)
        b.stepSimulation()
        trail.append(np.array((x, y)))
        contacts += sum(each[2] not in (floor, robot) for each in b.getContactPoints(robot))
    print(f"{np.hypot(*(trail[-1] - world.goal)):.2f} m from the goal after {time:.1f} s; {contacts} contacts")
    if png is not None:
        save_drive(world, np.array(trail), "A TurtleBot3 in PyBullet", png)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
