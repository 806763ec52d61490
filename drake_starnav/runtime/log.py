"""A run as an MCAP file: what came in, in order, and what was commanded; and its replay, bit for bit.

All of it is ROS 2 messages in CDR, so that Foxglove, Lichtblick and `rosbags` open it: `/scan` (and `/scan_2`, ...),
`/odom`, `/cmd_vel`, `/tf`, `/tf_static`, and path and regions as markers, `/starnav/plan`. `/starnav/run` holds the
scenario and mounts, and `/starnav/tick`, one message a command, time, odometry to the bit, goal, twist, status, reason:
both are JSON in a `std_msgs/String`.
"""

import json
import math
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import Mount
from drake_starnav.loading import parse_scenario
from drake_starnav.runtime.execution import CommandedVelocity
from drake_starnav.runtime.intake import Odometry, make_canonical_scan
from drake_starnav.runtime.navigator import Command, Navigator
from drake_starnav.runtime.ros2_definitions import decode_string, encode, write_definition
from drake_starnav.scenario.scenario_file import format_scenario
from drake_starnav.systems.star_perception import lidar_names
from drake_starnav.utils.files import explain_missing_file, explain_read_errors

if TYPE_CHECKING:
    from drake_starnav.runtime.loop import Reading

RUN, TICK, TF, STATIC_TF, PLAN, ODOM, TWIST = (
    "/starnav/run", "/starnav/tick", "/tf", "/tf_static", "/starnav/plan", "/odom", "/cmd_vel"
)  # fmt: skip
KINDS = {
    RUN: "std_msgs/String",
    TICK: "std_msgs/String",
    TF: "tf2_msgs/TFMessage",
    STATIC_TF: "tf2_msgs/TFMessage",
    PLAN: "visualization_msgs/MarkerArray",
    ODOM: "nav_msgs/Odometry",
    TWIST: "geometry_msgs/Twist",
}
SCAN = "sensor_msgs/LaserScan"
LARGEST_CHUNK, LARGEST_RATIO = 1 << 24, 200
"""Bytes of an expanded chunk at most, and of all of them as a multiple of the file's."""
PLAN_PERIOD = 0.5
"""Between two messages with the plan, s."""
MOST_REGIONS, SAMPLE_STEP = 20, 8
"""Regions that are shown, each by every eighth sample."""
PATH_COLOR, REGION_COLOR = (
    dict(zip("rgba", each, strict=True)) for each in ((0.8, 0.3, 0.0, 1.0), (0.0, 0.6, 0.0, 0.5))
)
SCAN_NUMBERS = ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time", "range_min", "range_max")
"""Fields of the message in their order; `angle_max` follows from the others."""
LINE_STRIP = 4
"""The type of a marker."""
LOGS = "an MCAP file as drive(log=...) writes it"


def _import_mcap() -> Any:
    try:
        import mcap.records
        import mcap.stream_reader
        import mcap.writer
    except ImportError:
        raise StarnavError("logs need the package mcap; allowed: pip install 'drake-starnav[mcap]'") from None
    return mcap


def encode_scan(scan: LaserScan, frame: str) -> bytes:
    """The scan as a ROS message in CDR."""
    header = {"stamp": _make_stamp(round(scan.time * 1e9)), "frame_id": frame}
    scan_numbers = {name: getattr(scan, name) for name in SCAN_NUMBERS}
    return encode(SCAN, {"header": header, "ranges": scan.ranges, **scan_numbers})


def decode_scan(message: bytes, time: float) -> LaserScan:
    """The scan of such a message, with its time, s, which the stamp only holds in nanoseconds."""
    (frame_length,) = struct.unpack_from("<I", message, 12)
    numbers_start = 16 + frame_length + -frame_length % 4
    scan_fields = dict(zip(SCAN_NUMBERS, struct.unpack_from("<7f", message, numbers_start), strict=True))
    del scan_fields["angle_max"]
    (beam_count,) = struct.unpack_from("<I", message, numbers_start + 28)
    ranges = np.frombuffer(message, "<f4", beam_count, numbers_start + 32).astype(float)
    return LaserScan(time, ranges=ranges, lost_beams=True, **scan_fields)


class RunLog:
    """Writes a run."""

    def __init__(self, path: str | Path, navigator: Navigator) -> None:
        """Raises a `StarnavError` without the extra `mcap`, and an `OSError` where the file cannot be written."""
        mcap = _import_mcap()
        self._navigator, self._plan_time = navigator, -math.inf
        path = Path(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("wb")
        self._writer = writer = mcap.writer.Writer(self._file, chunk_size=1 << 18)
        writer.start(profile="ros2", library="drake_starnav")
        lidar_count = len(navigator.mounts)
        self._frames = lidar_names("lidar", lidar_count)
        scan_topics, kinds = [f"/{name}" for name in lidar_names("scan", lidar_count)], sorted({SCAN, *KINDS.values()})
        schemas = {
            kind: writer.register_schema(kind.replace("/", "/msg/"), "ros2msg", write_definition(kind).encode())
            for kind in kinds
        }
        self._scans = [writer.register_channel(topic, "cdr", schemas[SCAN]) for topic in scan_topics]
        self._channels = {topic: writer.register_channel(topic, "cdr", schemas[kind]) for topic, kind in KINDS.items()}
        self._begun = False

    def _begin(self, log_time: int) -> None:
        scenario, mounts = self._navigator.scenario, self._navigator.mounts
        run = {"name": scenario.name, "scenario": format_scenario(scenario), "mounts": mounts}
        self._write_json(RUN, log_time, run)
        places = zip(self._frames, mounts, strict=True)
        transforms = [_make_transform(log_time, "base_link", frame, mount) for frame, mount in places]
        self._add(STATIC_TF, log_time, {"transforms": transforms})
        self._begun = True

    def note(self, reading: "Reading", command: Command, delay: float = 0.0) -> None:
        """What came, as of `Navigator.step`, what was commanded, and how long after `now` it was sent, s."""
        current_time, log_time = reading.now, _to_nanoseconds(reading.now)
        if not self._begun:
            self._begin(log_time)
        arrivals = [self._write_scan(log_time, item) for item in reading.scans]
        rows = [self._write_odometry(log_time, row) for row in reading.odometry]
        velocity = CommandedVelocity.of(current_time, command.twist, self._navigator.actuation.limits)
        linear = {"x": velocity.v_x, "y": velocity.v_y}
        self._add(TWIST, log_time, {"linear": linear, "angular": {"z": velocity.turning}})
        tick = {
            "now": _check_finite(current_time),
            "scans": arrivals,
            "odometry": rows,
            "goal": _make_row(reading.goal),
            "reset": reading.reset,
            "twist": command.twist.tolist(),
            "took": delay,
        }
        answer = {"certified": command.certified, "status": command.status, "why": command.why}
        self._write_json(TICK, log_time, tick | answer)
        if not abs(current_time - self._plan_time) < PLAN_PERIOD:
            self._plan_time = current_time
            self._write_plan(log_time)

    def _write_scan(self, log_time: int, item: Any) -> tuple[int, float]:
        """Write what came as a scan; returns the number of its lidar, -1 for what is no scan, and its time, s."""
        k, scan = item if isinstance(item, tuple) else (0, item)
        if not isinstance(scan, LaserScan) or k not in range(len(self._scans)):
            return -1, 0.0
        message = encode_scan(make_canonical_scan(scan), self._frames[k])
        self._writer.add_message(self._scans[k], log_time, message, _to_nanoseconds(scan.time))
        return k, scan.time

    def _write_odometry(self, log_time: int, row: Any) -> list[float | None] | None:
        """Write what came as odometry, if its numbers are finite; returns them as JSON holds them."""
        numbers = _make_row(row)
        if isinstance(row, Odometry) and numbers and None not in numbers:
            stamp = _to_nanoseconds(row.time)
            transform = _make_transform(stamp, "odom", "base_link", Mount(row.x, row.y, row.yaw, False))
            self._add(TF, log_time, {"transforms": [transform]})
            place, turn = transform["transform"]["translation"], transform["transform"]["rotation"]
            pose = {"pose": {"position": place, "orientation": turn}}
            twist = {"twist": {"linear": {"x": row.v, "y": row.aside}, "angular": {"z": row.omega}}}
            message = {"header": transform["header"], "child_frame_id": "base_link", "pose": pose, "twist": twist}
            self._add(ODOM, log_time, message)
        return numbers

    def _write_plan(self, log_time: int) -> None:
        path, outlines = read_plan(self._navigator)
        lines = [(np.vstack((each, each[:1])), REGION_COLOR) for each in outlines] + [(path, PATH_COLOR)]
        header = {"stamp": _make_stamp(log_time), "frame_id": "odom"}
        markers = [{"header": header, "action": 3}]  # delete what was shown before
        markers += [{"header": header, "ns": "plan", "id": k, **_make_line(*line)} for k, line in enumerate(lines)]
        self._add(PLAN, log_time, {"markers": markers})

    def _write_json(self, topic: str, log_time: int, value: dict[str, Any]) -> None:
        self._add(topic, log_time, {"data": json.dumps(value)})

    def _add(self, topic: str, log_time: int, values: dict[str, Any]) -> None:
        self._writer.add_message(self._channels[topic], log_time, encode(KINDS[topic], values), log_time)

    def close(self) -> None:
        """Complete the file; without it all but the end can be read."""
        if not self._begun:
            self._begin(0)
        self._writer.finish()
        self._file.close()


def read_plan(navigator: Navigator) -> tuple[np.ndarray, list[np.ndarray]]:
    """The path (n, 2) from the robot on, and the outlines (m, 2) of the newest regions, m; both may be empty."""
    port, rows = navigator.navigation.planned("guidance"), navigator.intake.rows
    if port is None or not rows:
        return np.zeros((0, 2)), []
    guidance, outlines = navigator.value(port), []
    for center, bearing, values in list(zip(*guidance.regions[:3], strict=True))[-MOST_REGIONS:]:
        sample_angles = bearing + 2.0 * math.pi * np.arange(0, len(values), SAMPLE_STEP) / len(values)
        directions = np.column_stack((np.cos(sample_angles), np.sin(sample_angles)))
        outlines.append(center + values[::SAMPLE_STEP, None] * directions)
    return np.vstack((rows[-1][1:3], np.reshape(guidance.path, (-1, 2)))), outlines


def _make_line(places: np.ndarray, color: dict[str, float]) -> dict[str, Any]:
    """The fields of a marker that shows a line through places (n, 2), m."""
    points = [{"x": x, "y": y} for x, y in np.round(places, 3).tolist()]
    pose = {"orientation": {"w": 1.0}}
    return {"type": LINE_STRIP, "pose": pose, "scale": {"x": 0.02}, "points": points, "color": color}


def _make_transform(stamp: int, parent: str, child: str, mount: Mount) -> dict[str, Any]:
    half_yaw = 0.5 * mount.yaw
    rotation = {"z": math.sin(half_yaw), "w": math.cos(half_yaw)}
    if mount.upside_down:  # half a turn about x, then the yaw
        rotation = {"x": math.cos(half_yaw), "y": math.sin(half_yaw)}
    transform = {"translation": {"x": mount.x, "y": mount.y}, "rotation": rotation}
    header = {"stamp": _make_stamp(stamp), "frame_id": parent}
    return {"header": header, "child_frame_id": child, "transform": transform}


def _make_stamp(nanoseconds: int) -> dict[str, int]:
    return dict(zip(("sec", "nanosec"), divmod(nanoseconds, 10**9), strict=True))


def _to_nanoseconds(time: float) -> int:
    return max(round(time * 1e9), 0) if math.isfinite(time) else 0


def _check_finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _make_row(values: Any) -> list[float | None] | None:
    """Numbers as JSON holds them, to the bit; None for what are none."""
    try:
        return [_check_finite(float(each)) for each in values]
    except (TypeError, ValueError):
        return None


def _read_number(value: float | None) -> float:
    return math.nan if value is None else float(value)


class Tick(NamedTuple):
    """A command of a log, with what `Navigator.step` was called with, and how long after `now` it was sent, s."""

    inputs: tuple[float, list[Any], list[Any], Any, bool]
    command: Command
    took: float


class Log(NamedTuple):
    """A run as its file has it; `ticks` can be read once."""

    name: str
    scenario: str
    mounts: tuple[Mount, ...]
    ticks: Iterator[Tick]

    def make_navigator(self) -> Navigator:
        """The navigator that drove it."""
        return Navigator(parse_scenario(self.scenario, name=self.name), mounts=self.mounts, warm=False)


def read_log(path: str | Path) -> Log:
    """Open the log of a run; a `StarnavError` for what is none. One that was cut off ends where it does."""
    log_name, log_messages = f"log {path}", _read_messages(Path(path))
    with explain_read_errors(log_name, LOGS):
        topic, message_data = next(log_messages, ("", b""))
        if topic != RUN:
            raise ValueError("it is not the log of a run")
        run = json.loads(decode_string(message_data))
        mounts = tuple(
            Mount(float(x), float(y), float(yaw), bool(down), float(tilt)) for x, y, yaw, down, tilt in run["mounts"]
        )
        if not (isinstance(run["name"], str) and isinstance(run["scenario"], str) and mounts):
            raise ValueError("its run has no name, scenario and mounts")
        return Log(run["name"], run["scenario"], mounts, _read_ticks(log_messages, log_name, len(mounts)))


def _read_messages(path: Path) -> Iterator[tuple[str, bytes]]:
    """Topic and content of each message, in order; a chunk is expanded alone, and within bounds."""
    mcap = _import_mcap()
    records, exceptions, topics, expanded_size = mcap.records, mcap.exceptions, {}, LARGEST_CHUNK
    with explain_read_errors(f"log {path}", LOGS):
        if file_fault := explain_missing_file(path):
            raise ValueError(file_fault)
        largest_size = LARGEST_CHUNK + LARGEST_RATIO * path.stat().st_size
        with path.open("rb") as file:
            stream = mcap.stream_reader.StreamReader(file, emit_chunks=True, record_size_limit=LARGEST_CHUNK)
            try:
                for outer_record in stream.records:
                    inner_records = [outer_record]
                    if isinstance(outer_record, records.Chunk):
                        outer_record.data, outer_record.compression = _expand(outer_record), ""
                        expanded_size += len(outer_record.data)
                        if expanded_size > largest_size:
                            raise ValueError(f"it expands to more than {LARGEST_RATIO} times its size")
                        inner_records = mcap.stream_reader.breakup_chunk(outer_record)
                    for record in inner_records:
                        if isinstance(record, records.Channel):
                            topics[record.id] = record.topic
                        elif isinstance(record, records.Message):
                            yield topics[record.channel_id], record.data
            except exceptions.RecordLengthLimitExceeded:
                raise
            except (exceptions.McapError, exceptions.EndOfFile, struct.error):
                return  # the loop was killed: this is its last chunk


def _expand(chunk: Any) -> bytes:
    """The content of a chunk; a `ValueError` where it is larger than LARGEST_CHUNK, or not as our logs are."""
    zstandard = _import_mcap().stream_reader.zstandard
    if chunk.compression not in ("", "zstd"):
        raise ValueError(f"a chunk is compressed by {chunk.compression[:10]}, and not by zstd")
    chunk_data = chunk.data
    if chunk.compression:
        decompressor = zstandard.ZstdDecompressor(max_window_size=LARGEST_CHUNK)
        chunk_data = decompressor.stream_reader(chunk_data).read(LARGEST_CHUNK + 1)
    if len(chunk_data) > LARGEST_CHUNK:
        raise ValueError(f"a chunk expands to more than {LARGEST_CHUNK >> 20} MB")
    return chunk_data


def _read_ticks(messages: Iterator[tuple[str, bytes]], place: str, lidars: int) -> Iterator[Tick]:
    scan_messages: list[bytes] = []
    for topic, data in messages:
        if topic == TICK:
            with explain_read_errors(place, LOGS):
                tick = _read_tick(json.loads(decode_string(data)), scan_messages, lidars)
            scan_messages = []
            yield tick
        elif topic not in KINDS:
            scan_messages.append(data)


def _read_tick(tick: dict[str, Any], messages: list[bytes], lidars: int) -> Tick:
    """A command with the scans before it; raises anything where it is none."""
    arrivals = [(int(k), float(time)) for k, time in tick["scans"]]
    lidar_numbers = [k for k, _ in arrivals if k >= 0]
    if len(lidar_numbers) > len(messages) or any(k >= lidars for k in lidar_numbers):
        raise ValueError("a command has other scans than were written before it")
    scan_messages = iter(messages)
    scans = [None if k < 0 else (k, decode_scan(next(scan_messages), time)) for k, time in arrivals]
    rows = [None if row is None else Odometry(*map(_read_number, row)) for row in tick["odometry"]]
    goal = None if tick["goal"] is None else tuple(map(_read_number, tick["goal"]))
    twist = np.array(tick["twist"], float)
    if twist.ndim != 1 or len(twist) not in (2, 3):
        raise ValueError(f"a twist has the shape {twist.shape}")
    command = Command(twist, bool(tick["certified"]), str(tick["status"]), str(tick["why"]))
    return Tick((_read_number(tick["now"]), scans, rows, goal, bool(tick["reset"])), command, float(tick["took"]))


class Replayed(NamedTuple):
    """How a replay went.

    Attributes:
        ticks: commands in the log, up to the first that differs.
        differs: the number of that, from 0; None: all are equal to the bit.
        logged_command, new_command: the two there.
    """

    ticks: int
    differs: int | None = None
    logged_command: Command | None = None
    new_command: Command | None = None

    def __str__(self) -> str:
        if self.differs is None:
            return f"all {self.ticks} commands are equal to the bit"
        assert self.logged_command is not None and self.new_command is not None
        logged_twist, replayed_twist = self.logged_command.twist.tolist(), self.new_command.twist.tolist()
        return (
            f"command {self.differs} differs: {logged_twist} {self.logged_command.status}, and now "
            f"{replayed_twist} {self.new_command.status}"
        )


def replay(path: str | Path) -> Replayed:
    """Navigate again by what came in during the run of a log, and compare each command with the one that was given."""
    log = read_log(path)
    navigator, tick_count = log.make_navigator(), 0
    for tick_count, tick in enumerate(log.ticks, start=1):
        command = navigator.step(*tick.inputs)
        if command.twist.tobytes() != tick.command.twist.tobytes() or command.status != tick.command.status:
            return Replayed(tick_count, tick_count - 1, tick.command, command)
    return Replayed(tick_count)
