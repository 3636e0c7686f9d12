"""Which topics a robot's ports have, by their types and by the table `[ros]` of its board file."""

import math
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import pytest
from firmware_drivers.chips.mpu9250_burst import InertialSample
from firmware_drivers.differential_drive import Velocity

from firmware_runtime.board.registry import load
from firmware_runtime.board.ros.names import ros_name
from firmware_runtime.board.ros.topics import Topics, topics, topics_of
from firmware_runtime.board.settings import RosSettings, RosTopicSettings
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.wire_errors import Fault
from firmware_runtime.models.motion import Motion
from tests.support.installed_here import installed_here


class Gait(Enum):
    WALK = 1
    RUN = 2


class Sample(NamedTuple):
    acceleration: tuple[float, float, float]
    field: tuple[float, ...] | None
    number: int


@dataclass
class Words:
    said: str


class Source(Atomic):
    """A model with an output port of each of these types, named as it is stated."""

    def __init__(self, name: str, **types: type[Any]) -> None:
        super().__init__(name)
        for port, kind in types.items():
            self.out_port(port, kind)

    def output(self) -> None: ...
    def internal(self) -> None: ...
    def external(self, elapsed: int) -> None: ...


def robot(*sources: Source, **inputs: type[Any]) -> Coupled:
    made = Coupled("robot")
    for source in sources:
        made.add(source)
    for name, kind in inputs.items():
        made.in_port(name, kind)
    return made


def published(found: Topics) -> dict[str, str]:
    return {each.topic: each.message.type for each in found.publications}


def taken(found: Topics) -> list[tuple[str, str]]:
    return [(each.topic, each.message.type) for each in found.subscriptions]


def stated(*tables: RosTopicSettings) -> RosSettings:
    return RosSettings(topics=tables)


# Types ------------------------------------------------------------------------------------------


def test_plain_types_are_messages_of_std_msgs() -> None:
    source = Source("legs", on=bool, steps=int, angle=float, word=str, gait=Gait, sample=Sample)
    assert published(topics(robot(source), RosSettings())) == {
        "legs/on": "std_msgs/msg/Bool",
        "legs/steps": "std_msgs/msg/Int64",
        "legs/angle": "std_msgs/msg/Float64",
        "legs/word": "std_msgs/msg/String",
        "legs/gait": "std_msgs/msg/String",
        "legs/sample": "std_msgs/msg/Float64MultiArray",
    }


def test_a_record_is_its_numbers_and_their_names() -> None:
    (each,) = topics(robot(Source("a", b=Sample)), RosSettings()).publications
    value = {"acceleration": [1.0, "inf", 3.0], "field": None, "number": 4}
    fields = each.message.fields(value, each.options)
    assert fields is not None
    (dimension,) = fields["layout"]["dim"]
    assert dimension["label"] == "acceleration.0,acceleration.1,acceleration.2,field,number"
    assert (dimension["size"], dimension["stride"]) == (5, 5)
    assert fields["data"][:3] == [1.0, math.inf, 3.0]
    assert math.isnan(fields["data"][3])
    (each,) = topics(robot(Source("a", duties=tuple)), RosSettings()).publications
    assert each.message.fields([0.5, 1], each.options) is not None
    with pytest.raises(TypeError, match="expected a number"):
        each.message.fields([0.5, "off"], each.options)


def test_what_holds_no_numbers_alone_has_no_topic_and_it_is_said_why() -> None:
    found = topics(robot(Source("a", words=Words, fault=Fault)), RosSettings())
    assert published(found) == {}
    assert set(found.without) == {"a.words", "a.fault"}
    assert "Words" in found.without["a.words"]
    assert "/diagnostics" in found.without["a.fault"]


def test_inputs_of_the_top_model_are_taken() -> None:
    found = topics(robot(yaw=float, place=Motion, words=Words), RosSettings())
    assert taken(found) == [
        ("yaw", "std_msgs/msg/Float64"),
        ("place", "std_msgs/msg/Float64MultiArray"),
    ]
    place = found.subscriptions[1].message
    assert place.value(SimpleNamespace(data=[1.0, 2.0]), {}) == {"position": 1.0, "rate": 2.0}
    with pytest.raises(ValueError, match="3 numbers, expected 2"):
        place.value(SimpleNamespace(data=[1.0, 2.0, 3.0]), {})


def test_a_velocity_is_taken_as_twist_and_as_twist_stamped() -> None:
    found = topics(robot(drive=Velocity), RosSettings())
    assert taken(found) == [
        ("cmd_vel", "geometry_msgs/msg/Twist"),
        ("cmd_vel", "geometry_msgs/msg/TwistStamped"),
    ]
    assert [each.message.is_stamped for each in found.subscriptions] == [False, True]


def test_the_only_inertial_sensor_is_called_imu_and_one_of_two_by_its_own_name() -> None:
    one = topics(robot(Source("chip", sample=InertialSample)), RosSettings())
    assert list(published(one)) == ["imu/data_raw", "imu/mag", "imu/temperature"]
    assert {each.frame for each in one.publications} == {"imu_link"}
    two = robot(Source("left", sample=InertialSample), Source("right", sample=InertialSample))
    assert {each.frame for each in topics(two, RosSettings()).publications} == {
        "left_link",
        "right_link",
    }
    assert "left/data_raw" in published(topics(two, RosSettings()))
    assert [ros_name(each) for each in ("a-b", "2nd", "Ä")] == ["a_b", "_2nd", "_"]


# [ros] ------------------------------------------------------------------------------------------


def test_a_port_may_have_another_name_frame_and_rate_or_no_topic() -> None:
    ros = stated(
        RosTopicSettings("chip.sample", name="top/imu", frame="mast", rate_hz=5.0),
        RosTopicSettings("chip.on", off=True),
    )
    found = topics(robot(Source("chip", sample=InertialSample, on=bool)), ros)
    assert found.faults == []
    assert list(published(found)) == ["top/imu/data_raw", "top/imu/mag", "top/imu/temperature"]
    assert {(each.frame, each.rate_hz) for each in found.publications} == {("mast", 5.0)}
    assert found.without == {"chip.on": "off in board.toml"}
    inner, top = Coupled("inner"), robot()
    inner.add(Source("pid", command=float, error=float))
    top.add(inner)
    found = topics(top, stated(RosTopicSettings("inner.pid.command")))
    assert published(found) == {"inner/pid/command": "std_msgs/msg/Float64"}


def test_every_fault_of_the_table_is_found() -> None:
    ros = stated(
        RosTopicSettings("chip.smaple"),
        RosTopicSettings("chip.on", frame="mast", convention="sonnar"),
        RosTopicSettings("chip.on", name="b"),
        RosTopicSettings("yaw", rate_hz=2.0, options={"gain": 1.0}),
        RosTopicSettings("chip.angle", name="chip/count"),
        RosTopicSettings("chip.off", off=True, rate_hz=3.0),
        RosTopicSettings("chip.word", frame="mast"),
        RosTopicSettings("chip.gait", convention="sonarr"),
    )
    types = {"on": bool, "angle": float, "count": int, "off": bool, "word": str, "gait": float}
    source = Source("chip", sample=InertialSample, **types)
    faults = topics(robot(source, yaw=float), ros).faults
    for said in (
        "'chip.smaple': no such port",
        "did you mean chip.sample?",
        "'chip.on': stated before",
        "options.gain: has no effect",
        "yaw: rate_hz: has no effect",
        "chip/count is the topic of chip.angle and of chip.count",
        "chip.off: rate_hz: has no effect; off is true",
        "chip.word: frame: has no effect",
        "did you mean sonar?",
    ):
        assert any(said in fault for fault in faults), (said, faults)


def test_a_convention_makes_a_number_a_range() -> None:
    ros = stated(
        RosTopicSettings(
            "eye.metres", convention="sonar", options={"max_range_m": 2.0, "min_range_m": 0.1}
        )
    )
    (each,) = topics(robot(Source("eye", metres=float)), ros).publications
    assert (each.topic, each.message.type) == ("eye/range", "sensor_msgs/msg/Range")
    assert (each.message.fields(3.0, each.options) or {})["range"] == math.inf


def test_a_package_of_ones_own_brings_its_own_convention(tmp_path: Path) -> None:
    text = """
from typing import NamedTuple
from firmware_runtime.board.ros.conventions import Convention, Outgoing
class Fix(NamedTuple):
    latitude: float
GPS = Convention(of=Fix, base="gps", out=(Outgoing(
    type="sensor_msgs/msg/NavSatFix", leaf="fix", is_stamped=True,
    fields=lambda fix, options: {"latitude": fix["latitude"]}),))
"""
    entries = "[firmware_runtime.ros_messages]\ngps = heronmsgs.messages:GPS\n"
    with installed_here(tmp_path, "heronmsgs", {"messages.py": text}, entries):
        from heronmsgs.messages import Fix  # type: ignore[import-not-found]  # noqa: PLC0415

        found = topics(robot(Source("receiver", fix=Fix)), RosSettings())
        assert published(found) == {"gps/fix": "sensor_msgs/msg/NavSatFix"}


def test_a_broken_convention_is_named_with_its_entry_point(tmp_path: Path) -> None:
    entries = "[firmware_runtime.ros_messages]\ngps = heronbroken.messages:GPS\n"
    with (
        installed_here(tmp_path, "heronbroken", {"messages.py": "GPS = 5\n"}, entries),
        pytest.raises(ConfigError, match="entry point gps") as refused,
    ):
        topics(robot(), RosSettings())
    assert "5: expected a Convention" in str(refused.value)


# Boards -----------------------------------------------------------------------------------------


def test_the_topics_of_tachobot_and_a_wrong_port_in_its_file(tmp_path: Path) -> None:
    copy = tmp_path / "board.toml"
    copy.write_text(load("tachobot").source.read_text() + '[[ros.topics]]\nport = "imu.smaple"\n')
    with pytest.raises(ConfigError, match=r"ros\.topics\[0\]\.port") as refused:
        topics_of(load(str(copy)))
    assert "did you mean imu.sample?" in str(refused.value)
    found = topics_of(load("tachobot"))
    assert published(found) == {
        "thrust_pairs/applied": "std_msgs/msg/Int64",
        "thrust_pairs/duties": "std_msgs/msg/Float64MultiArray",
        "imu/data_raw": "sensor_msgs/msg/Imu",
        "imu/mag": "sensor_msgs/msg/MagneticField",
        "imu/temperature": "sensor_msgs/msg/Temperature",
        "controller/forces": "std_msgs/msg/Float64MultiArray",
    }
    assert taken(found) == [("yaw_reference", "std_msgs/msg/Float64")]


def test_the_detectives_sonars_are_ranges_and_its_compasses_headings() -> None:
    found = topics_of(load("detective"))
    types = published(found)
    assert types["radar_sonar/range"] == "sensor_msgs/msg/Range"
    assert types["body_compass/heading"] == "geometry_msgs/msg/QuaternionStamped"
    assert types["joint_states"] == "sensor_msgs/msg/JointState"
    options = {each.topic: each.options for each in found.publications}
    assert options["radar_sonar/range"]["max_range_m"] == pytest.approx(5.031)
    assert options["radar_compass/heading"]["clockwise"] == 0.0
