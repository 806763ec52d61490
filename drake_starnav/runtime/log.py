"""A run as an MCAP file: what came in, in order, and what was commanded; and its replay, bit for bit.

Foxglove and Lichtblick show it: `/scan` (and `/scan_2`, ...) as `sensor_msgs/msg/LaserScan`, `/tf`, path and regions as
`/starnav/plan`, and `/starnav/tick`, one message a command with the time, odometry, goal, twist, status and reason.
`/starnav/run` holds scenario and mounts.
"""

import json
import math
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import Mount
from drake_starnav.loading import parse_scenario
from drake_starnav.navigation import Parts
from drake_starnav.navigation.parts import AS_DECLARED
from drake_starnav.runtime.intake import Odometry, canonical
from drake_starnav.runtime.navigator import Command, Navigator
from drake_starnav.scenario.scenario_file import scenario_text
from drake_starnav.systems.star_perception import lidar_names
from drake_starnav.utils.files import reading

RUN, TICK, TF, PLAN = "/starnav/run", "/starnav/tick", "/tf", "/starnav/plan"
SCHEMAS = {RUN: "starnav.Run", TICK: "starnav.Tick", TF: "foxglove.FrameTransform", PLAN: "foxglove.SceneUpdate"}
SHOWN = 0.5
"""Between two messages with the plan, s."""
MOST, EACH = 20, 8
"""Regions that are shown, each by every eighth sample."""
PATH_COLOR, REGION_COLOR = (
    dict(zip("rgba", each, strict=True)) for each in ((0.8, 0.3, 0.0, 1.0), (0.0, 0.6, 0.0, 0.5))
)
SCAN_NUMBERS = ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time", "range_min", "range_max")
"""Fields of the message in their order; `angle_max` follows from the others."""
RULE = f"\n{80 * '='}\n"
SCAN_SCHEMA = RULE.join(
    (
        "std_msgs/Header header\n" + "\n".join(f"float32 {name}" for name in SCAN_NUMBERS)
        + "\nfloat32[] ranges\nfloat32[] intensities",
        "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id",
        "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec",
    )
)  # fmt: skip
LOGS = "an MCAP file as drive(log=...) writes it"


def _mcap() -> Any:
    try:
        import mcap.reader
        import mcap.stream_reader
        import mcap.writer
    except ImportError:
        raise StarnavError("logs need the package mcap; allowed: pip install 'drake-starnav[mcap]'") from None
    return mcap


def scan_message(scan: LaserScan, frame: str) -> bytes:
    """The scan as a ROS message in CDR."""
    seconds, nanoseconds = divmod(round(scan.time * 1e9), 10**9)
    name = frame.encode() + b"\0"
    numbers = struct.pack("<7f", *(getattr(scan, each) for each in SCAN_NUMBERS))
    head = struct.pack("<iII", seconds, nanoseconds, len(name)) + name + bytes(-len(name) % 4)
    ranges = scan.ranges.astype("<f4").tobytes()
    return b"\0\1\0\0" + head + numbers + struct.pack("<I", len(scan.ranges)) + ranges + struct.pack("<I", 0)


def scan_of(message: bytes, time: float) -> LaserScan:
    """The scan of such a message, with its time, s, which the stamp only holds in nanoseconds."""
    (length,) = struct.unpack_from("<I", message, 12)
    at = 16 + length + -length % 4
    fields = dict(zip(SCAN_NUMBERS, struct.unpack_from("<7f", message, at), strict=True))
    del fields["angle_max"]
    (count,) = struct.unpack_from("<I", message, at + 28)
    ranges = np.frombuffer(message, "<f4", count, at + 32).astype(float)
    return LaserScan(time, ranges=ranges, lost_beams=True, **fields)


class RunLog:
    """Writes a run."""

    def __init__(self, path: Path, navigator: Navigator) -> None:
        """Raises a `StarnavError` without the extra `mcap`, and an `OSError` where the file cannot be written."""
        mcap = _mcap()
        self._navigator, self._shown = navigator, -math.inf
        self._file = path.open("wb")
        self._writer = writer = mcap.writer.Writer(self._file, chunk_size=1 << 18)
        writer.start(profile="ros2", library="drake_starnav")
        scan = writer.register_schema("sensor_msgs/msg/LaserScan", "ros2msg", SCAN_SCHEMA.encode())
        count = len(navigator.mounts)
        self._frames = lidar_names("lidar", count)
        self._scans = [writer.register_channel(f"/{name}", "cdr", scan) for name in lidar_names("scan", count)]
        self._channels = {}
        for topic, schema in SCHEMAS.items():
            number = writer.register_schema(schema, "jsonschema", b'{"type": "object"}')
            self._channels[topic] = writer.register_channel(topic, "json", number)
        text = scenario_text(navigator.scenario)
        run = {"name": navigator.scenario.name, "scenario": text, "mounts": navigator.mounts}
        self._json(RUN, 0, run)
        for frame, mount in zip(self._frames, navigator.mounts, strict=True):
            self._transform(0, "base_link", frame, mount)

    def note(self, reading: Any, command: Command, took: float = 0.0) -> None:
        """What came, as of `Navigator.step`, what was commanded, and how long after `now` it was sent, s."""
        now, scans, odometry, goal = reading
        at, came = _nanoseconds(now), []
        for item in scans:
            k, scan = item if isinstance(item, tuple) else (0, item)
            if not isinstance(scan, LaserScan) or k not in range(len(self._scans)):
                came.append((-1, 0.0))
                continue
            message = scan_message(canonical(scan), self._frames[k])
            self._writer.add_message(self._scans[k], at, message, _nanoseconds(scan.time))
            came.append((k, scan.time))
        odometry = list(odometry)
        rows = [_row(each) for each in odometry]
        if rows and isinstance(odometry[-1], Odometry) and None not in (rows[-1] or [None]):
            self._transform(at, "odom", "base_link", Mount(*odometry[-1][1:4], False))
        tick = {
            "now": _finite(now),
            "scans": came,
            "odometry": rows,
            "goal": _row(goal),
            "twist": command.twist.tolist(),
            "took": took,
        }
        self._json(TICK, at, tick | {"certified": command.certified, "status": command.status, "why": command.why})
        if not abs(now - self._shown) < SHOWN:
            self._shown = now
            self._show(at)

    def _show(self, at: int) -> None:
        path, outlines = planned(self._navigator)
        lines = [_line(each, REGION_COLOR, closed=True) for each in outlines] + [_line(path, PATH_COLOR)]
        entity = {"timestamp": _stamp(at), "frame_id": "odom", "id": "plan", "lines": lines}
        self._json(PLAN, at, {"entities": [entity], "deletions": []})

    def _transform(self, at: int, parent: str, child: str, mount: Mount) -> None:
        half = 0.5 * mount.yaw
        turn = {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)}
        if mount.upside_down:  # half a turn about x, then the yaw
            turn = {"x": math.cos(half), "y": math.sin(half), "z": 0.0, "w": 0.0}
        place = {"x": mount.x, "y": mount.y, "z": 0.0}
        frames = {"parent_frame_id": parent, "child_frame_id": child, "translation": place, "rotation": turn}
        self._json(TF, at, {"timestamp": _stamp(at), **frames})

    def _json(self, topic: str, at: int, value: dict[str, Any]) -> None:
        self._writer.add_message(self._channels[topic], at, json.dumps(value).encode(), at)

    def close(self) -> None:
        """Complete the file; without it all but the end can be read."""
        self._writer.finish()
        self._file.close()


def planned(navigator: Navigator) -> tuple[np.ndarray, list[np.ndarray]]:
    """The path (n, 2) from the robot on, and the outlines (m, 2) of the newest regions, m; both may be empty."""
    port, rows = navigator.navigation.planned("guidance"), navigator.intake.rows
    if port is None or not rows:
        return np.zeros((0, 2)), []
    guidance, outlines = navigator.value(port), []
    for center, bearing, values in list(zip(*guidance.regions[:3], strict=True))[-MOST:]:
        angles = bearing + 2.0 * math.pi * np.arange(0, len(values), EACH) / len(values)
        outlines.append(center + values[::EACH, None] * np.column_stack((np.cos(angles), np.sin(angles))))
    return np.vstack((rows[-1][1:3], np.reshape(guidance.path, (-1, 2)))), outlines


def _line(places: np.ndarray, color: dict[str, float], *, closed: bool = False) -> dict[str, Any]:
    points = [{"x": x, "y": y, "z": 0.0} for x, y in np.round(places, 3).tolist()]
    pose = {"position": {"x": 0.0, "y": 0.0, "z": 0.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}
    return {"type": int(closed), "pose": pose, "thickness": 0.02, "points": points, "color": color}


def _stamp(at: int) -> dict[str, int]:
    return dict(zip(("sec", "nsec"), divmod(at, 10**9), strict=True))


def _nanoseconds(time: float) -> int:
    return max(round(time * 1e9), 0) if math.isfinite(time) else 0


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _row(values: Any) -> list[float | None] | None:
    """Numbers as JSON holds them, to the bit; None for what are none."""
    try:
        return [_finite(float(each)) for each in values]
    except (TypeError, ValueError):
        return None


def _number(value: float | None) -> float:
    return math.nan if value is None else value


class Tick(NamedTuple):
    """A command of a log, with what `Navigator.step` was called with, and how long after `now` it was sent, s."""

    inputs: tuple[float, list[Any], list[Any], Any]
    command: Command
    took: float


class Log(NamedTuple):
    """A run as its file has it; `ticks` can be read once."""

    name: str
    scenario: str
    mounts: tuple[Mount, ...]
    ticks: Iterator[Tick]

    def navigator(self, parts: Parts = AS_DECLARED, **options: Any) -> Navigator:
        """The navigator that drove it."""
        scenario = parse_scenario(self.scenario, name=self.name)
        return Navigator(scenario, parts, mounts=self.mounts, warm=False, **options)


def read_log(path: str | Path) -> Log:
    """Open the log of a run; a `StarnavError` for what is none. One that was cut off ends where it does."""
    messages = _messages(Path(path))
    topic, data = next(messages, ("", b""))
    if topic != RUN:
        raise StarnavError(f"{path} is not the log of a run; allowed: {LOGS}")
    run = json.loads(data)
    mounts = tuple(Mount(*each) for each in run["mounts"])
    return Log(run["name"], run["scenario"], mounts, _ticks(messages))


def _messages(path: Path) -> Iterator[tuple[str, bytes]]:
    mcap = _mcap()
    with reading(f"log {path}", LOGS), path.open("rb") as file:
        try:
            for _, channel, message in mcap.reader.NonSeekingReader(file).iter_messages(log_time_order=False):
                yield channel.topic, message.data
        except (mcap.exceptions.McapError, mcap.exceptions.EndOfFile, struct.error):
            return  # the loop was killed: this is its last chunk


def _ticks(messages: Iterator[tuple[str, bytes]]) -> Iterator[Tick]:
    waiting: list[bytes] = []
    for topic, data in messages:
        if topic == TICK:
            tick = json.loads(data)
            came, scans = iter(waiting), []
            for k, time in tick["scans"]:
                scans.append(None if k < 0 else (k, scan_of(next(came), time)))
            waiting = []
            rows = [None if row is None else Odometry(*map(_number, row)) for row in tick["odometry"]]
            goal = None if tick["goal"] is None else tuple(map(_number, tick["goal"]))
            twist = np.array(tick["twist"])
            command = Command(twist, tick["certified"], tick["status"], tick["why"])
            yield Tick((_number(tick["now"]), scans, rows, goal), command, tick.get("took", 0.0))
        elif topic not in SCHEMAS:
            waiting.append(data)


class Replayed(NamedTuple):
    """How a replay went.

    Attributes:
        ticks: commands in the log, up to the first that differs.
        differs: the number of that, from 0; None: all are equal to the bit.
        logged, given: the two commands there.
    """

    ticks: int
    differs: int | None = None
    logged: Command | None = None
    given: Command | None = None

    def __str__(self) -> str:
        if self.differs is None:
            return f"all {self.ticks} commands are equal to the bit"
        assert self.logged is not None and self.given is not None
        was, now = self.logged.twist.tolist(), self.given.twist.tolist()
        return f"command {self.differs} differs: {was} {self.logged.status}, and now {now} {self.given.status}"


def replay(
    path: str | Path, parts: Parts = AS_DECLARED, *, watch: Callable[[Navigator, Tick], None] | None = None
) -> Replayed:
    """Navigate again by what came in during a run, and compare each command with the one that was given.

    Args:
        path: of the log.
        parts: as the run had them.
        watch: called after each command.
    """
    log = read_log(path)
    navigator, count = log.navigator(parts), 0
    for count, tick in enumerate(log.ticks, start=1):
        given = navigator.step(*tick.inputs)
        if watch is not None:
            watch(navigator, tick)
        same = given.twist.tobytes() == tick.command.twist.tobytes() and given.status == tick.command.status
        if not same:
            return Replayed(count, count - 1, tick.command, given)
    return Replayed(count)
