"""Settings that every board has: the executive's, the buses', and the types of their values."""

from typing import Annotated, ClassVar, Literal, TypeAlias

from msgspec import Meta, Struct

from firmware_runtime.devs.time import MICROSECOND

Positive: TypeAlias = Annotated[float, Meta(gt=0)]
NotNegative: TypeAlias = Annotated[float, Meta(ge=0)]
Seconds: TypeAlias = Annotated[float, Meta(gt=0, le=1e9)]
"""A duration; in whole nanoseconds it still fits into 64 bits."""
SecondsOrNone: TypeAlias = Annotated[float, Meta(ge=0, le=1e9)]
Microseconds: TypeAlias = Annotated[float, Meta(gt=0, le=1e15)]
Fraction: TypeAlias = Annotated[float, Meta(ge=0, le=1)]
Percent: TypeAlias = Annotated[float, Meta(ge=0, le=100)]
Address: TypeAlias = Annotated[int, Meta(ge=0x08, le=0x77)]
Channel: TypeAlias = Annotated[int, Meta(ge=0, le=15)]
DeviceNode: TypeAlias = Annotated[str, Meta(pattern=r"^[^\x00]+$")]
"""Path of a device node; none is empty, none has a NUL in it."""
TopicName: TypeAlias = Annotated[
    str, Meta(pattern=r"^[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*$", max_length=200)
]
"""Name of a ROS topic, relative to a namespace."""
TopicRate: TypeAlias = Annotated[float, Meta(ge=0, le=1000)]
"""Messages in a second, at most; 0: every one."""
Policy: TypeAlias = Literal["skip", "catch-up", "stop"]


class Settings(Struct, frozen=True, forbid_unknown_fields=True):
    """A table of a board file."""


class BusSettings(Settings, frozen=True):
    """One I2C bus."""

    device: DeviceNode
    speed_hz: Annotated[float, Meta(ge=1)]
    """Clock rate the kernel was configured for; this project cannot set it."""
    attempts: Annotated[int, Meta(ge=1, le=10)] = 3
    """How often a transaction is tried before its failure counts as a fault."""
    overhead_us: Annotated[float, Meta(ge=0, le=1e6)] = 0.0
    """Time that adapter and kernel take for a transaction beside its bits."""
    timeout_ms: Annotated[int, Meta(ge=10, le=2000)] = 100
    """How long a transaction may take on a bus that is held, in whole tens. Less than [guard]
    stall_s, or the guard acts before the run can say what happened."""

    @property
    def overhead_ns(self) -> int:
        """The same in whole nanoseconds."""
        return round(self.overhead_us * MICROSECOND)


class PortSettings(Settings, frozen=True):
    """One serial port."""

    device: DeviceNode
    baud: Annotated[int, Meta(gt=0)]


class OutputEnableSettings(Settings, frozen=True):
    """The GPIO line at the OE pins of the board's PCA9685, where it is wired."""

    chip: DeviceNode
    """The GPIO chip's."""
    line: Annotated[int, Meta(ge=0, le=0xFFFF_FFFF)]
    """Offset of the line on that chip."""
    active_low: bool = True
    """Whether outputs are enabled by a low level, as at the OE pin itself."""


class LatePolicy(Settings, frozen=True, tag_field="policy"):
    """Policy for activations of one model that come late."""

    policy: ClassVar[Policy]
    tolerance_us: Microseconds | None = None
    """Lateness up to this is no overrun; default a tenth of the period."""


class SkipPolicy(LatePolicy, frozen=True, tag="skip"):
    """Whole periods are skipped; so it is where no policy is stated."""

    is_default_variant: ClassVar[bool] = True
    policy: ClassVar[Policy] = "skip"


class CatchUpPolicy(LatePolicy, frozen=True, tag="catch-up"):
    """Every missed activation runs."""

    policy: ClassVar[Policy] = "catch-up"


class StopPolicy(LatePolicy, frozen=True, kw_only=True, tag="stop"):
    """Every missed activation runs, until one is too late."""

    policy: ClassVar[Policy] = "stop"
    stop_after_us: Microseconds
    """Lateness beyond which outputs go off and the run ends."""


ModelPolicy: TypeAlias = SkipPolicy | CatchUpPolicy | StopPolicy


class PathDeadlineSettings(Settings, frozen=True):
    """Deadline from a sensor's sample to an actuator's write."""

    source: str
    """Output port of the sensor, such as `imu.sample`."""
    actuator: str
    """Model that writes, such as `thrust_pairs`."""
    within_us: Microseconds


class ArmingSettings(Settings, frozen=True):
    """Terms on which a robot's outputs may be driven; doubles made for a run always may be."""

    at_start: bool = False
    """Arm as soon as nothing speaks against it; otherwise `firmware-runtime arm` does."""
    demand_guard: bool = True
    """Be armed only while `firmware-runtime guard` watches over the run."""
    max_late_percent: Percent = 1.0
    """Of the last 5 s' activations, how many may have been late or skipped; none of them later than
    a period. 100: neither is judged."""


class GuardSettings(Settings, frozen=True):
    """Terms on which the guard switches off."""

    stall_s: Annotated[float, Meta(ge=0.1, le=10)] = 0.2
    """Time without a finished step after which the run counts as dead, s."""


class RosTopicSettings(Settings, frozen=True):
    """Topic of one port in ROS 2, where it is not what its type says."""

    port: str
    """An input port of the top model, or a component's output port, such as `imu.sample`."""
    name: TopicName | None = None
    """Of the topic, below the robot's namespace; of a port with several, what they stand below."""
    frame: Annotated[str, Meta(min_length=1, max_length=200)] | None = None
    """The frame in its headers."""
    rate_hz: TopicRate | None = None
    convention: str | None = None
    """A package's convention by its name, for a type that does not say what it is."""
    options: dict[str, float] = {}
    """Numbers of that convention, such as `field_of_view_rad`."""
    off: bool = False
    """No topic."""


class RosSettings(Settings, frozen=True):
    """Topics of the robot's ROS 2 node."""

    rate_hz: TopicRate = 50.0
    """Of each topic that is published, unless its values are events: all of those are."""
    topics: tuple[RosTopicSettings, ...] = ()


class ExecutiveSettings(Settings, frozen=True):
    """OS scheduling and memory settings, and the loop; what is not granted is reported."""

    fifo_priority: Annotated[int, Meta(ge=0, le=99)] = 0
    """SCHED_FIFO priority, 0 for none asked."""
    lock_memory: bool = False
    cpus: tuple[int, ...] = ()
    """Cores to run on, none for any."""
    freeze_garbage: bool = True
    """Freeze what exists at start and collect garbage between ticks only."""
    timer_slack_ns: Annotated[int, Meta(ge=1)] = 1
    keep_cpu_awake: bool = False
    """Hold /dev/cpu_dma_latency at 0, so that no processor sleeps deeply."""
    switch_off_s: Annotated[float, Meta(ge=0, le=5)] = 1.0
    """How long a run that ends goes on switching outputs off where that fails, s; 0: once."""
    spin_us: Annotated[float, Meta(ge=0, le=1000)] = 0.0
    """Busy-wait this long before each deadline, 0 for none."""
    max_lag_s: Annotated[float, Meta(ge=0.05, le=10)] = 0.2
    """So long behind the clock without catching up, and outputs go off and the run ends, s."""
    max_load_percent: Annotated[float, Meta(ge=10, le=100)] = 90.0
    """Of real time, over three seconds, that may go into steps or into processor time; 100: any."""
    overload: Literal["yield", "stop"] = "yield"
    """Above that: `yield` gives up SCHED_FIFO and, where there was one, disarms; `stop` ends."""
    bring_up_s: Annotated[float, Meta(ge=1, le=600)] = 60.0
    """Time that a service may take for each stage of its start, s."""
    watchdog_s: Annotated[float, Meta(ge=0.5, le=60)] = 2.0
    """Time without a finished step after which systemd ends the service, s; longer than stall_s."""
    worst: Annotated[int, Meta(ge=1, le=64)] = 16
    """How many of the worst activations are kept."""


class RecordingSettings(Settings, frozen=True):
    """Recording of a run, so that it can be run again."""

    minutes: Annotated[float, Meta(ge=0, le=1440)] = 10.0
    """How much of it, the last that was; the memory it takes is bounded. 0: nothing is kept."""
    sync_s: Annotated[float, Meta(ge=0, le=3600)] = 10.0
    """How often `recordings collect` writes to its disk, s: what power loss costs. 0: never."""
    keep_mib: Annotated[float, Meta(ge=1, le=1e6)] = 1024.0
    """What `recordings collect` may take of its disk for recordings; the oldest make room."""


class LinkSettings(Settings, frozen=True):
    """Terms of the link between the two ends of a board in two processes, see `roles`."""

    timeout_s: Annotated[float, Meta(ge=0.2, le=10)] = 0.5
    """So old a command, or so long silent the other end, and outputs go off, s."""
    good_s: Annotated[float, Meta(ge=0, le=60)] = 0.5
    """So long the link must have been good before outputs are driven, s."""
    keep: Annotated[int, Meta(ge=1, le=64)] = 1
    """How many values of a port are kept where several come at once; older ones are dropped."""
    limits: dict[str, tuple[float, float]] = {}
    """By crossing port: least and greatest number that a value may hold."""
    retain: tuple[str, ...] = ()
    """Crossing ports whose last value an end gets that comes later, or again."""
    ordered: tuple[str, ...] = ()
    """Crossing ports whose values all arrive, in order: events; of others the newest counts."""


class BoardSettings(Settings, frozen=True, kw_only=True):
    """Settings of every board; its own schema is derived from it, with `kw_only=True`.

    A file may also have a key `name`, the robot's own where two are of one kind; that key is no
    setting.
    """

    board: str
    """The kind: the name of the entry point."""
    description: str
    buses: dict[str, BusSettings] = {}
    ports: dict[str, PortSettings] = {}
    executive: ExecutiveSettings = ExecutiveSettings()
    arming: ArmingSettings = ArmingSettings()
    guard: GuardSettings = GuardSettings()
    recording: RecordingSettings = RecordingSettings()
    output_enable: OutputEnableSettings | None = None
    overruns: dict[str, ModelPolicy] = {}
    deadlines: tuple[PathDeadlineSettings, ...] = ()
    roles: dict[str, tuple[str, ...]] = {}
    """Components of the top model by role, for runs in two processes, see `roles`."""
    link: LinkSettings = LinkSettings()
    ros: RosSettings = RosSettings()
