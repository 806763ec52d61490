"""Laser scans, the errors of a sensor, and the ray casts of a simulated one."""

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.scan_log import LoggedScan, read_scan_log
from drake_starnav.lidar.sensor_model import LidarParameters

__all__ = ["LaserScan", "LidarParameters", "LoggedScan", "read_scan_log"]
