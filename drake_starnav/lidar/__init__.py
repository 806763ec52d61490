"""Laser scans, and the errors of a sensor."""

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.scan_log import LoggedScan, read_scan_log
from drake_starnav.lidar.sensor_model import LidarParameters

__all__ = ["LaserScan", "LidarParameters", "LoggedScan", "read_scan_log"]
