import math
from itertools import pairwise

import pytest

from firmware_runtime.models.motion import Path, Profile
from firmware_runtime.models.trajectory_file import Spline
from firmware_runtime.models.trajectory_paths import Circle, Hold, Line, Pose, RejoinLimits, rejoin

STEP_S = 1e-4
HERE, THERE = Pose(1.0, -2.0, 0.5), Pose(4.0, 2.0, -1.5)

PATHS: dict[str, Path] = {
    "trapezoid": Line(HERE, THERE, 0.5, 0.25, "trapezoid"),
    "short trapezoid": Line(HERE, Pose(1.1, -2.0, 0.5), 0.5, 0.25, "trapezoid"),
    "minimum jerk": Line(HERE, THERE, 0.5, 0.25, "minimum-jerk"),
    "circle": Circle(HERE, 1.0, 20.0, start_rad=0.3),
    "clockwise circle that turns": Circle(HERE, 2.0, 30.0, clockwise=True, turns=True),
    "spline": Spline([(0.0, *HERE), (2.0, 3.0, 1.0, 0.0), (3.0, 2.0, 2.0, 1.0), (5.0, *THERE)]),
}


def instants(path: Path) -> list[float]:
    whole_s = min(path.duration_s, 40.0)
    return [whole_s * n / 97 + 0.013 for n in range(96)]


@pytest.mark.parametrize("path", PATHS.values(), ids=PATHS)
def test_rate_is_the_change_of_position(path: Path) -> None:
    for t_s in instants(path):
        before, now, after = path.at(t_s - STEP_S), path.at(t_s), path.at(t_s + STEP_S)
        for a, at, b in zip(before, now, after, strict=True):
            assert (b.position - a.position) / (2 * STEP_S) == pytest.approx(at.rate, abs=1e-4)


@pytest.mark.parametrize(
    "name", ["minimum jerk", "circle", "clockwise circle that turns", "spline"]
)
def test_acceleration_is_the_change_of_rate(name: str) -> None:
    path = PATHS[name]
    for t_s in instants(path):
        before, now, after = path.at(t_s - STEP_S), path.at(t_s), path.at(t_s + STEP_S)
        for a, at, b in zip(before, now, after, strict=True):
            change = (b.rate - a.rate) / (2 * STEP_S)
            assert change == pytest.approx(at.acceleration, abs=1e-3)


def test_a_trapezoid_speeds_up_and_slows_down_evenly() -> None:
    line = PATHS["trapezoid"]
    for t_s, sign in ((0.5, 1.0), (line.duration_s / 2, 0.0), (line.duration_s - 0.5, -1.0)):
        x, y, _ = line.at(t_s)
        assert math.hypot(x.acceleration, y.acceleration) == pytest.approx(abs(sign) * 0.25)
        assert math.copysign(1.0, x.acceleration) == (sign or 1.0)


@pytest.mark.parametrize("profile", ["trapezoid", "minimum-jerk"])
@pytest.mark.parametrize("end", [THERE, Pose(1.05, -2.0, 0.5)], ids=["far", "near"])
def test_a_line_exceeds_neither_its_speed_nor_its_acceleration_and_reaches_one_of_them(
    profile: Profile, end: Pose
) -> None:
    line = Line(HERE, end, 0.5, 0.25, profile)
    points = [line.at(line.duration_s * n / 1000) for n in range(1001)]
    speed = max(math.hypot(x.rate, y.rate) for x, y, _ in points)
    acceleration = max(math.hypot(x.acceleration, y.acceleration) for x, y, _ in points)
    assert speed <= 0.5 + 1e-9
    assert acceleration <= 0.25 + 1e-9
    assert speed > 0.499 or acceleration > 0.2499
    for (x, y, _), (later_x, later_y, _) in pairwise(points):
        moved_m = math.hypot(later_x.position - x.position, later_y.position - y.position)
        assert moved_m <= 0.5 * line.duration_s / 1000 + 1e-9


@pytest.mark.parametrize("profile", ["trapezoid", "minimum-jerk"])
def test_a_line_begins_and_ends_at_rest_at_its_poses(profile: Profile) -> None:
    line = Line(HERE, THERE, 0.5, 0.25, profile)
    for t_s, pose in ((0.0, HERE), (line.duration_s, THERE), (line.duration_s + 9.0, THERE)):
        for setpoint, position in zip(line.at(t_s), pose, strict=True):
            assert setpoint.position == pytest.approx(position)
            assert setpoint.rate == 0.0


def test_a_line_to_where_it_begins_is_refused() -> None:
    with pytest.raises(ValueError, match="no length"):
        Line(HERE, HERE._replace(yaw_rad=2.0), 0.5, 0.25, "trapezoid")


def test_a_circle_keeps_its_radius_and_comes_back_after_a_lap() -> None:
    circle = Circle(HERE, 1.5, 20.0, start_rad=math.pi / 2)
    x, y, yaw = circle.at(0.0)
    assert (x.position, y.position) == pytest.approx((1.0, -0.5))
    assert yaw == (0.5, 0.0, 0.0)
    for t_s in instants(circle):
        x, y, _ = circle.at(t_s)
        assert math.hypot(x.position - 1.0, y.position + 2.0) == pytest.approx(1.5)
        assert circle.at(t_s + 20.0).x.position == pytest.approx(x.position)


def test_a_circle_begins_ahead_of_its_centre_and_turns_to_the_left_unless_told_otherwise() -> None:
    x, y, _ = Circle(HERE, 1.5, 20.0).at(0.0)
    assert (x.position, y.position) == (HERE.x_m + 1.5, HERE.y_m)
    assert (x.rate, y.rate) == pytest.approx((0.0, 1.5 * math.tau / 20.0))


def test_a_hold_is_at_rest_where_it_says() -> None:
    assert Hold(HERE).duration_s == 0.0
    for setpoint, position in zip(Hold(HERE).at(3.0), HERE, strict=True):
        assert setpoint == (position, 0.0, 0.0)


def test_a_trapezoid_moves_at_constant_speed_in_between() -> None:
    line = PATHS["trapezoid"]
    middle = [line.at(line.duration_s / 2 + n * 0.1) for n in range(-10, 11)]
    assert all(a.x.rate == b.x.rate for a, b in pairwise(middle))


BACK = RejoinLimits(0.5, 0.25, 0.75, least_s=0.1, ramp_s=2.0)
STRAYED = {
    "far": ((3.0, 0.0), (4.0, 0.0), (0.0, 0.0)),
    "near": ((0.03, 0.0), (-0.04, 0.0), (0.0, 0.0)),
    "fast": ((0.0, 0.3), (0.0, -0.4), (0.0, 0.0)),
    "turned": ((0.0, 0.0), (0.0, 0.0), (-2.0, 0.0)),
}


@pytest.mark.parametrize("offsets", STRAYED.values(), ids=STRAYED)
def test_the_way_back_to_a_path_exceeds_no_limit_and_reaches_one_of_them(
    offsets: tuple[tuple[float, float], ...],
) -> None:
    back, path = rejoin(offsets, BACK, 0.0), Hold(HERE).at(0.0)
    points = [back.added_to(path, back.duration_s * n / 1000) for n in range(1000)]
    shares = (
        max(math.hypot(x.rate, y.rate) for x, y, _ in points) / 0.5,
        max(math.hypot(x.acceleration, y.acceleration) for x, y, _ in points) / 0.25,
        max(abs(yaw.rate) for _, _, yaw in points) / 0.75,
    )
    assert 0.998 < max(shares) <= 1.0 + 1e-9
    for begins, ends, at, (off, rate) in zip(points[0], points[-1], path, offsets, strict=True):
        assert begins[:2] == pytest.approx((at.position + off, rate))
        assert ends == pytest.approx((at.position, 0.0, 0.0), abs=1e-2)


def test_the_way_back_takes_a_least_time_however_near_the_path_is() -> None:
    assert rejoin([(1e-6, 0.0), (0.0, 0.0), (0.0, 0.0)], BACK, 0.0).duration_s == 0.1
