"""A robot of ROS 2 that knows nothing of this package: rclpy with Fast DDS, and MuJoCo behind it, in real time.

Run, where those are installed: python rclpy_robot.py MODEL.xml '{"beams": 360, "range_max": 5.0, ...}' [--seconds S]

It publishes /scan and /odom, and does what the last /cmd_vel says, as bases without a timeout do. At the end it says
as JSON where it is, what it touched, and how old scans were when the command came that follows them.
"""

import argparse
import json
import math
import os
import signal
import threading
import time

import mujoco
import numpy as np
import rclpy
import rclpy.signals
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan

STEP, PERIOD, TRACK, WHEEL = 0.002, 0.02, 0.16, 0.05
parser = argparse.ArgumentParser()
parser.add_argument("model")
parser.add_argument("lidar", type=json.loads)
parser.add_argument("--goal", type=float, nargs=2)
parser.add_argument("--stamped", action="store_true")
parser.add_argument("--seconds", type=float, default=60.0)
options = parser.parse_args()
model = mujoco.MjModel.from_xml_path(options.model)
model.opt.timestep = STEP
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
count, reach, rate = options.lidar["beams"], options.lidar["range_max"], options.lidar["rate"]
angles = -math.pi + 2.0 * math.pi / count * np.arange(count)
rays = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(count)))
hits, ranges, group = np.zeros(count, np.int32), np.zeros(count), np.array((1, 0, 0, 0, 0, 0), np.uint8)
noise = np.random.default_rng(0)
rclpy.init(signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
ended = threading.Event()
signal.signal(signal.SIGINT, lambda *_: ended.set())
node = rclpy.create_node("robot")
scans = node.create_publisher(LaserScan, "scan", qos_profile_sensor_data)
odometry = node.create_publisher(Odometry, "odom", 10)
goals = node.create_publisher(PoseStamped, "goal_pose", 10)
twist, heard, scanned, ages, stamps = [0.0, 0.0], [0], [0.0], [], []


def told(message) -> None:
    found = message.twist if options.stamped else message
    twist[:] = found.linear.x, found.angular.z
    heard[0] += 1
    if scanned[0] > 0.0:
        ages.append(time.time() - scanned[0])
        scanned[0] = 0.0


node.create_subscription(TwistStamped if options.stamped else Twist, "cmd_vel", told, 10)
begin, tick, done, sent, touched, late = time.monotonic(), 0, 0, 0, 0, 0.0
while tick * PERIOD < options.seconds and not ended.is_set():
    wait = PERIOD
    while wait > 0.0:
        wait = begin + tick * PERIOD - time.monotonic()
        rclpy.spin_once(node, timeout_sec=max(wait, 0.0))
    late, elapsed = max(late, -wait), time.monotonic() - begin
    mujoco.mj_step(model, data, round(elapsed / STEP) - done)  # a base moves on, however late its computer is
    done = round(elapsed / STEP)
    stamp, now = node.get_clock().now().to_msg(), time.time()
    x, y, _, qw, qx, qy, qz = data.qpos[:7]
    yaw = math.atan2(2.0 * (qw * qz + qx * qy), qw * qw + qx * qx - qy * qy - qz * qz)
    row = Odometry(child_frame_id="base_link")
    row.header.stamp, row.header.frame_id = stamp, "odom"
    row.pose.pose.position.x, row.pose.pose.position.y = x, y
    row.pose.pose.orientation.z, row.pose.pose.orientation.w = math.sin(0.5 * yaw), math.cos(0.5 * yaw)
    row.twist.twist.linear.x = data.qvel[0] * math.cos(yaw) + data.qvel[1] * math.sin(yaw)
    row.twist.twist.angular.z = data.qvel[5]
    odometry.publish(row)
    if elapsed >= sent / rate - 0.5 * PERIOD:
        turned = (rays @ data.site_xmat[0].reshape(3, 3).T).ravel()
        mujoco.mj_multiRay(model, data, data.site_xpos[0], turned, group, 1, 1, hits, ranges, None, count, reach)
        noisy = np.maximum(ranges + options.lidar["noise"] * noise.standard_normal(count), 0.001)
        scan = LaserScan(angle_min=angles[0], angle_max=angles[-1], angle_increment=angles[1] - angles[0])
        scan.header.stamp, scan.header.frame_id = stamp, "laser"
        scan.range_max, scan.scan_time = reach, 1.0 / rate
        scan.ranges = np.where((ranges < 0.0) | (ranges >= reach), np.inf, noisy).astype(np.float32).tolist()
        scans.publish(scan)
        stamps.append(stamp.sec + 1e-9 * stamp.nanosec)
        sent, scanned[0] = max(sent, int(elapsed * rate)) + 1, now
    if options.goal and len(stamps) % 20 == 1:
        goal = PoseStamped()
        goal.header.frame_id = "odom"
        goal.pose.position.x, goal.pose.position.y = options.goal
        goal.pose.orientation.w = 0.0
        goals.publish(goal)
    v, omega = twist
    data.ctrl[:2] = (v - TRACK * omega) / WHEEL, (v + TRACK * omega) / WHEEL
    bodies = (
        model.body_rootid[model.geom_bodyid[each.geom]] for each in data.contact[: data.ncon] if 0 not in each.geom
    )
    touched += any(a != b for a, b in bodies)
    tick = max(tick, int(elapsed / PERIOD)) + 1
p50, p99 = (1e3 * float(np.percentile(ages or [math.nan], share)) for share in (50, 99))
said = {"place": [x, y], "touched": touched, "heard": heard[0], "scans": stamps, "twist": twist, "late": late}
print(json.dumps(said | {"p50": p50, "p99": p99}), flush=True)
os._exit(0)  # what rclpy does at its end may hang
