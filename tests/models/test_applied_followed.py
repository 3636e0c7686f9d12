"""What goes on by what was commanded stands still while nothing is applied of it."""

import pytest
from firmware_boards.tachobot.allocation import Allocation
from firmware_boards.tachobot.attitude import Attitude
from firmware_drivers.chips.mpu9250_burst import InertialSample

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.models.motion import Applied, Motion, Setpoint
from firmware_runtime.models.pid import Pid, PidGains, TrackingPid
from firmware_runtime.models.plant import SecondOrderPlant
from firmware_runtime.models.smith_predictor import SmithPredictor
from firmware_runtime.models.square_wave import SquareWave, Wave
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.models.state_table import Arrow, State
from tests.support.atomic_bench import AtomicBench

NOTHING, PART, ALL = Applied


def pids() -> list[Pid | TrackingPid]:
    gains = PidGains(kp=1.0, ki=0.5, kd=0.0, limit=10.0)
    return [Pid("pid", gains, 1.0), TrackingPid("pid", gains, 0.0, NEVER)]


@pytest.mark.parametrize("kind", [0, 1], ids=["Pid", "TrackingPid"])
@pytest.mark.parametrize(
    ("applied", "position", "integral"),
    [
        (NOTHING, 0.0, 0.0),
        (NOTHING, 2.0, 0.0),
        (PART, 0.0, 0.0),
        (ALL, 0.0, 0.5),
        (ALL, 2.0, -0.5),
    ],
)
def test_an_integral_learns_from_what_was_applied(
    kind: int, applied: Applied, position: float, integral: float
) -> None:
    pid = pids()[kind]
    alone = AtomicBench(pid)
    if kind:
        alone.put(0, setpoint=Setpoint(1.0, 0.0, 0.0))
    alone.put(0, measurement=Motion(position, 0.0), applied=applied)
    alone.put(1000, measurement=Motion(position, 0.0))
    assert pid.integral_n == pytest.approx(integral)


def test_what_an_integral_has_learned_is_kept_while_nothing_is_applied() -> None:
    pid = pids()[0]
    alone = AtomicBench(pid)
    alone.put(0, measurement=Motion(0.0, 0.0))
    alone.put(1000, measurement=Motion(0.0, 0.0), applied=NOTHING)
    assert pid.integral_n == 0.0
    alone.put(1001, applied=ALL)
    alone.put(2000, measurement=Motion(0.0, 0.0))
    learned = pid.integral_n
    alone.put(2001, applied=NOTHING)
    for second in range(3, 300):
        alone.put(1000 * second, measurement=Motion(0.5, 0.0))
    assert pid.integral_n == learned > 0.0


def test_an_integral_that_is_limited_further_on_leaves_the_limit() -> None:
    pid = pids()[0]
    pid.integral_n = 3.0
    alone = AtomicBench(pid)
    alone.put(0, measurement=Motion(1.0, 0.0), applied=PART)
    alone.put(1000, measurement=Motion(2.0, 0.0))
    assert pid.integral_n == pytest.approx(2.5)


@pytest.mark.parametrize("from_measurement", [True, False])
def test_a_predictor_expects_nothing_of_commands_that_are_not_applied(
    from_measurement: bool,  # noqa: FBT001 -- a parameter of the test
) -> None:
    plant = SecondOrderPlant(gain=5.0, lag_s=0.03)
    model = SmithPredictor("smith", plant, 80 * MILLISECOND, from_measurement=from_measurement)
    alone = AtomicBench(model)
    alone.put(0, applied=NOTHING)
    for at_ms in range(10, 5000, 10):
        alone.put(at_ms, measurement=Motion(0.25, 0.0))
        alone.put(at_ms, command=1.0)
    assert alone.values("predicted")[-1] == Motion(0.25, 0.0)
    alone.put(5000, applied=ALL, measurement=Motion(0.25, 0.0))
    assert alone.values("predicted")[-1].rate > 0.1


def test_a_wave_waits_at_its_beginning_and_goes_on_where_it_was() -> None:
    alone = AtomicBench(SquareWave("wave", Motion, Wave(1.0, 4 * SECOND, SECOND, 1)))
    tick = Motion(0.0, 0.0)
    alone.put(0, applied=NOTHING)
    alone.put(60_000, tick=tick)
    alone.put(60_001, applied=ALL)
    alone.put(61_500, tick=tick)
    alone.put(61_501, applied=NOTHING)
    alone.put(90_000, tick=tick, applied=ALL)
    alone.put(91_900, tick=tick)
    alone.put(93_000, tick=tick)
    assert alone.values("level") == [1.0, -1.0, -1.0, 1.0, 0.0]


class Sweep(StateDiagram):
    """Waits for a hop, then turns for a second."""

    def __init__(self) -> None:
        super().__init__("sweep")
        self.applied_in = self.in_port("applied", Applied)
        self.over = self.out_port("over", int)
        self.follow(
            (
                State("preparing", 10 * MILLISECOND, Arrow("over!0", "turning")),
                State("turning", SECOND, Arrow("over!1", "done"), moving=True),
                State("done", NEVER),
            )
        )


def test_the_time_of_a_motion_stands_still_while_nothing_moves_and_other_time_does_not() -> None:
    alone = AtomicBench(Sweep())
    alone.put(0, applied=NOTHING)
    alone.put(5000)
    assert (alone.model.phase, alone.values("over")) == ("turning", [0])
    alone.put(5000, applied=ALL)
    alone.put(5600, applied=NOTHING)
    alone.put(60_000, applied=PART)
    alone.put(60_399)
    assert alone.model.phase == "turning"
    alone.put(60_401)
    assert (alone.model.phase, alone.values("over")) == ("done", [0, 1])


def test_x_and_y_hear_of_the_pairs_and_of_giving_way_to_yaw() -> None:
    alone = AtomicBench(Allocation("allocation", 0.4, NEVER))
    alone.put(0, pairs_applied=NOTHING)
    alone.put(10, pairs_applied=ALL, x_n=0.5)
    alone.put(20, yaw_n=0.1)
    alone.put(30, yaw_n=0.8)
    alone.put(40, yaw_n=0.8)
    alone.put(50, yaw_n=0.0)
    assert alone.values("position_applied") == [NOTHING, ALL, PART, ALL]
    assert len(alone.values("forces")) == 4


def test_an_attitude_that_was_disabled_on_the_way_has_turned_with_the_robot() -> None:
    def turning(rate: float) -> InertialSample:
        return InertialSample((0.0, 0.0, 9.8), (0.0, 0.0, rate), None, 20.0, False)

    alone = AtomicBench(Attitude("attitude", 0, enabled=True))
    alone.put(0, sample=turning(0.0))
    alone.put(10, sample=turning(0.2), enable=False)
    for at_ms in range(20, 1010, 10):
        alone.put(at_ms, sample=turning(0.2))
    for at_ms in range(1010, 60_000, 1000):
        alone.put(at_ms, sample=turning(0.0))
    sent = len(alone.values("yaw"))
    alone.put(60_000, enable=True)
    alone.put(60_010, sample=turning(0.0))
    assert len(alone.values("yaw")) == sent + 1
    assert alone.values("yaw")[-1].position == pytest.approx(0.2, abs=0.01)
