"""A recording as MCAP: the topics that its ROS 2 node has, and what is in no topic.

    /BOARD/imu/data_raw             as `ros2 BOARD` publishes it, but every message
    /BOARD/ports/controller/yaw/... other ports: std_msgs by type, or a String with JSON
    /BOARD/raw/i2c1                 each transfer on a line: what was asked, read, or how it failed
    /BOARD/raw/clock                each step: how late it began, what the clock said, ns
    /BOARD/markers                  arming, settings, faults, steps that began late, the end

Everything is a message of ROS 2 (ros2msg, CDR) with its definition in the file: readers of bags
refuse a file with any other encoding. Times are instants of the run, ns since its start.
"""

import io
import json
from collections.abc import Iterable, Mapping
from typing import Any, Final

from firmware_runtime.board.registry import Board
from firmware_runtime.board.ros.conventions import Outgoing
from firmware_runtime.board.ros.names import ros_name
from firmware_runtime.board.ros.plain_types import TEXT, plain_convention
from firmware_runtime.board.ros.topics import Publication, topics_of
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.devs.wiring import sources_of
from firmware_runtime.hal.wire_errors import Fault
from firmware_runtime.recording.blackbox.ring_file import Header
from firmware_runtime.recording.blackbox.section import (
    DISCARD,
    READ,
    WRITE,
    Kind,
    Section,
    Transfer,
)
from firmware_runtime.recording.exports.chosen_ports import ChosenPorts
from firmware_runtime.recording.exports.typed_values import (
    Port,
    Sent,
    entered_in,
    entrance,
    model_of,
    ports_of,
    values_in,
)
from firmware_runtime.recording.replay.difference import shown
from firmware_runtime.statistics.json_values import plain
from firmware_runtime.statistics.number_formats import NO_DATES, Dates
from firmware_runtime.system.packages import module_of_extra

_COVARIANCE: Final = "float64[9]"
TRANSFER: Final = "firmware_runtime/msg/Transfer"
STEP: Final = "firmware_runtime/msg/Step"
MARKER: Final = "firmware_runtime/msg/Marker"
_FIELDS: Final[dict[str, str]] = {
    "firmware_runtime/Transfer": "string device\nstring[] messages\nuint8[] read\nstring error",
    "firmware_runtime/Step": "int64 late_ns\nint64[] readings_ns\nstring entered",
    "firmware_runtime/Marker": "string what\nstring port\nstring detail",
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "std_msgs/Bool": "bool data",
    "std_msgs/Int64": "int64 data",
    "std_msgs/Float64": "float64 data",
    "std_msgs/String": "string data",
    "std_msgs/MultiArrayDimension": "string label\nuint32 size\nuint32 stride",
    "std_msgs/MultiArrayLayout": "std_msgs/MultiArrayDimension[] dim\nuint32 data_offset",
    "std_msgs/Float64MultiArray": "std_msgs/MultiArrayLayout layout\nfloat64[] data",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1",
    "geometry_msgs/QuaternionStamped": "std_msgs/Header header\n"
    "geometry_msgs/Quaternion quaternion",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    "sensor_msgs/Imu": "std_msgs/Header header\n"
    f"geometry_msgs/Quaternion orientation\n{_COVARIANCE} orientation_covariance\n"
    f"geometry_msgs/Vector3 angular_velocity\n{_COVARIANCE} angular_velocity_covariance\n"
    f"geometry_msgs/Vector3 linear_acceleration\n{_COVARIANCE} linear_acceleration_covariance",
    "sensor_msgs/MagneticField": "std_msgs/Header header\n"
    f"geometry_msgs/Vector3 magnetic_field\n{_COVARIANCE} magnetic_field_covariance",
    "sensor_msgs/Temperature": "std_msgs/Header header\nfloat64 temperature\nfloat64 variance",
    "sensor_msgs/Range": "uint8 ULTRASOUND=0\nuint8 INFRARED=1\nstd_msgs/Header header\n"
    "uint8 radiation_type\nfloat32 field_of_view\nfloat32 min_range\nfloat32 max_range\n"
    "float32 range\nfloat32 variance",
    "sensor_msgs/JointState": "std_msgs/Header header\nstring[] name\nfloat64[] position\n"
    "float64[] velocity\nfloat64[] effort",
    "sensor_msgs/BatteryState": "std_msgs/Header header\nfloat32 voltage\nfloat32 temperature\n"
    "float32 current\nfloat32 charge\nfloat32 capacity\nfloat32 design_capacity\n"
    "float32 percentage\nuint8 power_supply_status\nuint8 power_supply_health\n"
    "uint8 power_supply_technology\nbool present\nfloat32[] cell_voltage\n"
    "float32[] cell_temperature\nstring location\nstring serial_number",
}
_RULE: Final = "=" * 80


def definition_of(message: str) -> str | None:
    """The definition of a type such as `sensor_msgs/msg/Imu`, and of all in it; None: not known."""
    name = message.replace("/msg/", "/")
    if name not in _FIELDS:
        return None
    texts = [_FIELDS[name]]
    texts += [f"{_RULE}\nMSG: {each}\n{_FIELDS[each]}" for each in _within(name)]
    return "\n".join(texts) + "\n"


def _within(name: str) -> list[str]:
    """The types of fields, at any depth, each once."""
    found: dict[str, None] = {}
    for line in _FIELDS[name].splitlines():
        kind = line.split()[0].partition("[")[0]
        if kind in _FIELDS:
            found |= dict.fromkeys((kind, *_within(kind)))
    return list(found)


LATE: Final = MILLISECOND
"""A step that begins so long after its instant has a marker."""
_PORT_USES: Final = {WRITE: "write", READ: "read", DISCARD: "discard"}
_MARKED: Final = {
    Kind.BUILD: "built",
    Kind.PROBE: "probed",
    Kind.SAFE: "outputs off",
    Kind.RETUNED: "settings",
    Kind.EXIT: "exit",
    Kind.ENDED: "ended",
}


def mcap_of(
    header: Header,
    board: Board,
    sections: Iterable[Section],
    dates: Dates = NO_DATES,
    chosen: ChosenPorts | None = None,
) -> bytes:
    """The bytes of an MCAP file, by the dates of the run; of chosen ports their values alone.

    Raises ConfigError without the extra.
    """
    into = io.BytesIO()
    writer = module_of_extra("mcap_ros2.writer", "mcap").Writer(into)
    export = _Export(header, board, writer, dates, chosen)
    for section in sections:
        export.add(section)
    writer.finish()
    return into.getvalue()


class _Export:
    """Writes section by section; `writer` is that of mcap_ros2."""

    def __init__(
        self,
        header: Header,
        board: Board,
        writer: Any,  # noqa: ANN401 -- of an extra
        dates: Dates,
        chosen: ChosenPorts | None,
    ) -> None:
        self._dates = dates
        self._chosen = chosen
        self._header = header
        self._below = f"/{ros_name(header.board)}"
        self._writer = writer
        model = model_of(header, board)
        self._ports = ports_of(model)
        self._in_ports = model.in_ports
        self._entrances = {entrance(name): port for name, port in model.in_ports.items()}
        self._topics = _topics(model, topics_of(board).publications, self._ports)
        self._others: dict[str, Outgoing | None] = {}
        self._schemas: dict[str, object] = {}
        self._count = 0

    def add(self, section: Section) -> None:
        """All that is in a section."""
        for transfer in section.transfers if self._chosen is None else ():
            line = self._header.lines[transfer.line]
            self._write(transfer.at, f"raw/{ros_name(line)}", TRANSFER, _transfer(transfer))
        if section.kind is Kind.STEP:
            self._step(section)
        elif (marked := marker_of(section)) is not None:
            self._mark(section.at, *marked)
        for entered in entered_in(section, self._in_ports):
            if self._has(entered.port):
                self._say(entered, plain(entered.value), self._entrances.get(entered.port))
        for sent in values_in(section, self._header.ports, self._ports):
            if self._has(sent.port):
                self._sent(sent)

    def _has(self, port: str) -> bool:
        return self._chosen is None or self._chosen.has(port)

    def _step(self, section: Section) -> None:
        clock = section.readings
        entered = [{"port": name, "value": shown(form)} for name, form in section.entered]
        late = max(0, clock[0] - section.at) if clock else 0
        said = {"late_ns": late, "readings_ns": clock, "entered": _text(entered) if entered else ""}
        if self._chosen is None:
            self._write(section.at, "raw/clock", STEP, said)
        if late >= LATE:
            self._mark(section.at, "late", f"{late} ns")

    def _sent(self, sent: Sent) -> None:
        value = plain(sent.value)
        port = self._ports.get(sent.port)
        if port is not None and issubclass(port.type, Fault):
            self._mark(sent.at, "fault", _text(value), sent.port)
        published = [
            self._publish(sent.at, each, value) for each in self._topics.get(sent.port, ())
        ]
        if not any(published):
            self._say(sent, value, port)

    def _publish(self, at: int, topic: Publication, value: object) -> bool:
        """Write it as this message; whether its value can be one."""
        message = topic.message
        try:
            fields = message.fields(value, topic.options)
            if fields is not None and message.is_stamped:
                date = self._date(at)
                stamp = {"sec": date // SECOND, "nanosec": date % SECOND}
                fields = {"header": {"stamp": stamp, "frame_id": topic.frame}, **fields}
            return fields is None or self._write(at, topic.topic, message.type, fields)
        except Exception:  # noqa: BLE001 -- of a package's own convention; it is said otherwise
            return False

    def _say(
        self,
        sent: Sent,
        value: object,
        port: Port | InPort[object] | None,
    ) -> None:
        """Write a value of a port that has no topic, as its type is in ROS 2, or as JSON."""
        where = "/".join(("ports", *map(ros_name, sent.port.split("."))))
        if sent.port not in self._others:
            known = plain_convention(type(sent.value) if port is None else port.type)
            self._others[sent.port] = known.out[0] if known is not None else None
        message = self._others[sent.port]
        if message is not None:
            try:
                self._write(sent.at, where, message.type, message.fields(value, {}) or {})
            except (TypeError, ValueError, OverflowError, KeyError, IndexError):
                pass  # another value than its type says
            else:
                return
        self._write(sent.at, f"{where}/json", TEXT, {"data": _text(value)})

    def _mark(self, at: int, what: str, detail: str = "", port: str = "") -> None:
        self._write(at, "markers", MARKER, {"what": what, "port": port, "detail": detail})

    def _write(self, at: int, topic: str, message: str, fields: Mapping[str, object]) -> bool:
        """Write a message; false for one of a type that is not known here."""
        if message not in self._schemas:
            text = definition_of(message)
            made = None if text is None else self._writer.register_msgdef(message, text)
            self._schemas[message] = made
        schema = self._schemas[message]
        if schema is None:
            return False
        self._count = self._count + 1 & 0xFFFF_FFFF
        date = self._date(at)
        where = f"{self._below}/{topic}"
        self._writer.write_message(where, schema, fields, date, date, self._count)
        return True

    def _date(self, at: int) -> int:
        """The date of an instant, as a live bag has it; of a run without one the instant."""
        date = self._dates.of(at)
        return at if date is None else date


def _topics(
    model: Coupled, publications: Iterable[Publication], ports: Mapping[str, Port]
) -> dict[str, list[Publication]]:
    """The topics of each atomic's port, those of coupled models' ports that it reaches as well."""
    found: dict[str, list[Publication]] = {}
    for each in publications:
        published = _port_at(model, each.port)
        for source in () if published is None else sources_of(published):
            path = below_root(source.path)
            if path in ports:
                found.setdefault(path, []).append(each)
    return found


def _port_at(model: Coupled, path: str) -> OutPort[object] | None:
    """The output port at a path below the root; None where this end of two has it not."""
    *names, port = path.split(".")
    component: object = model
    for name in names:
        component = getattr(component, "components", {}).get(name)
    found: OutPort[object] | None = getattr(component, "out_ports", {}).get(port)
    return found


def marker_of(section: Section) -> tuple[str, str] | None:
    """Return the marker of a section that is no step."""
    if section.kind is Kind.ARMED:
        return ("armed" if section.extra else "disarmed"), ""
    what = _MARKED.get(section.kind)
    if what is None:
        return None
    if section.kind is Kind.ENDED and isinstance(section.extra, dict):
        return what, ": ".join(str(section.extra.get(key)) for key in ("state", "reason"))
    return what, ""


def _transfer(transfer: Transfer) -> dict[str, object]:
    """Written bytes as hexadecimal digits; of a bus also how many were to be read."""
    device = _PORT_USES.get(transfer.address, f"0x{transfer.address & 0xFF:02x}")
    asked = transfer.messages
    messages = [asked] if isinstance(asked, bytes) else asked
    return {
        "device": device,
        "messages": [each.hex() if isinstance(each, bytes) else str(each) for each in messages],
        "read": b"" if transfer.failed else transfer.answer,
        "error": ": ".join(map(str, transfer.answer)) if transfer.failed else "",
    }


def _text(value: object) -> str:
    return json.dumps(value, allow_nan=False)
