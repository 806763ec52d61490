"""A robot of ROS 2 as a process, in real time, by Cyclone DDS: what it is told it does exactly.

Run: python -m tests.helpers.ros_robot SCENARIO DOMAIN [--stamped] [--mounted] [--late S] [--seconds S]
"""

import argparse
import json
import math
import time

from drake_starnav.loading import load_scenario
from drake_starnav.runtime.ros2_base import STAMPED, TWIST, make_header
from drake_starnav.runtime.ros2_cyclone import Cyclone
from tests.helpers.bare_robot import BareRobot


class CommandedVelocity:
    """A command, for `BareRobot`."""

    def __init__(self, twist) -> None:
        self.twist = twist


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("scenario")
    parser.add_argument("domain", type=int)
    parser.add_argument("--stamped", action="store_true")
    parser.add_argument("--mounted", action="store_true", help="publish a transform from base_link to the lidar")
    parser.add_argument("--late", type=float, default=0.0, help="its clock is behind by this, s")
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--goal", action="store_true", help="publish the world's goal")
    options = parser.parse_args()
    scenario = load_scenario(options.scenario)
    robot, ros = BareRobot(scenario), Cyclone(options.domain, "lo")
    make, kind = ros.types, STAMPED if options.stamped else TWIST
    commands = ros.subscribe("/cmd_vel", kind, 1)
    plans, markers = (
        ros.subscribe("/plan", "nav_msgs/Path", 1),
        ros.subscribe("/markers", "visualization_msgs/MarkerArray", 1),
    )
    send_scan, send_odometry = ros.publish("/scan", "sensor_msgs/LaserScan"), ros.publish("/odom", "nav_msgs/Odometry")
    send_goal, send_mounts = ros.publish("/goal_pose", "geometry_msgs/PoseStamped"), None
    if options.mounted:
        send_mounts = ros.publish("/tf_static", "tf2_msgs/TFMessage", latched=True)
        turned = make.Transform(rotation=make.Quaternion(x=0.0, y=0.0, z=0.0, w=1.0))
        link = make.TransformStamped(header=make_header(make, time.time(), "base_link"), child_frame_id="laser")
        link.transform = turned
        send_mounts(make.TFMessage(transforms=[link]))
    BareRobot(scenario).drive(CommandedVelocity([0.0, 0.0]))  # compiles
    begin, twist, heard, seen = time.monotonic(), [0.0, 0.0], 0, {"plan": 0, "markers": 0}
    due = begin
    while time.monotonic() < begin + options.seconds:
        _, scans, odometry, goal, _ = robot.read()
        now = time.time() - options.late
        for row in odometry:
            half = 0.5 * row.yaw
            turn = make.Quaternion(z=math.sin(half), w=math.cos(half))
            pose = make.Pose(position=make.Point(x=row.x, y=row.y), orientation=turn)
            moved = make.Twist(linear=make.Vector3(x=row.v), angular=make.Vector3(z=row.omega))
            message = make.Odometry(header=make_header(make, now, "odom"), child_frame_id="base_link")
            message.pose.pose, message.twist.twist = pose, moved
            send_odometry(message)
        for scan in scans:
            fields = {name: getattr(scan, name) for name in ("angle_min", "angle_max", "angle_increment", "range_min")}
            ranges = scan.ranges.tolist()
            send_scan(
                make.LaserScan(
                    header=make_header(make, now, "laser"),
                    range_max=scan.range_max,
                    scan_time=0.05,
                    ranges=ranges,
                    **fields,
                )
            )
        if options.goal and robot.ticks % 50 == 0:
            position = make.Point(x=goal[0], y=goal[1])
            aim = make.Pose(position=position, orientation=make.Quaternion(w=0.0))
            send_goal(make.PoseStamped(header=make_header(make, now, "odom"), pose=aim))
        for message in commands():
            found = message.twist if options.stamped else message
            twist, heard = [found.linear.x, found.angular.z], heard + 1
        seen["plan"] += len(plans())
        seen["markers"] += len(markers())
        robot.drive(CommandedVelocity(twist))
        ahead = due + robot.period - time.monotonic()
        time.sleep(max(ahead, 0.0))
        due += robot.period + max(-ahead, 0.0)  # what is late stays late: no robot catches up
    away = math.dist(robot.pose[:2], robot.world.goal)
    print(json.dumps({"away": away, "clearance": robot.clearance, "heard": heard, "twist": twist, **seen}), flush=True)
    ros.close()


if __name__ == "__main__":
    main()
