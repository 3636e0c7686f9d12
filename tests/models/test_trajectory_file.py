from pathlib import Path

import pytest

from firmware_runtime.models.trajectory_file import Spline, path_of_file

HEADER = "t_s,x_m,y_m,yaw_rad\n"


def written(folder: Path, text: str) -> Path:
    file = folder / "path.csv"
    file.write_text(text)
    return file


def test_the_path_goes_through_every_pose_and_is_at_rest_at_both_ends(tmp_path: Path) -> None:
    path = path_of_file(written(tmp_path, HEADER + "0,0,1,0\n2,1,0,0.5\n3,2,0,0.5\n6,0,0,-1\n"))
    assert path.duration_s == 6.0
    for t_s, pose in ((0.0, (0, 1, 0)), (2.0, (1, 0, 0.5)), (3.0, (2, 0, 0.5)), (6.0, (0, 0, -1))):
        assert [each.position for each in path.at(t_s)] == pytest.approx(pose)
    for t_s in (0.0, 6.0, 9.0):
        assert [each.rate for each in path.at(t_s)] == [0.0, 0.0, 0.0]


def test_acceleration_does_not_jump_at_a_pose() -> None:
    path = Spline([(0.0, 0.0, 1.0, 0.0), (2.0, 1.0, 0.0, 0.5), (3.0, 2.0, 0.0, 3.0), (6.0,) * 4])
    for t_s in (2.0, 3.0):
        before, after = path.at(t_s - 1e-9), path.at(t_s)
        for a, b in zip(before, after, strict=True):
            assert a.acceleration == pytest.approx(b.acceleration, abs=1e-6)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("", "line 1: 'nothing'"),
        ("t,x,y,yaw\n0,0,0,0\n1,0,0,0\n", "line 1: 't,x,y,yaw'"),
        (HEADER + "0,0,0,0\n", "1 poses, expected 2"),
        (HEADER + "1,0,0,0\n2,0,0,0\n", "line 2: t_s 1, expected 0"),
        (HEADER + "0,0,0,0\n1,0,0,0\n1,0,0,0\n", "line 4: t_s 1, expected more than 1"),
        (HEADER + "0,0,0,0\n1,0,0\n", "line 3: '1,0,0', expected four finite numbers"),
        (HEADER + "0,0,0,0\n1,nan,0,0\n", "line 3: '1,nan,0,0'"),
        (HEADER + "0,0,0,0\n1,one,0,0\n", "line 3"),
        (HEADER + "0,0,0,0\n\n1,0,0,0\n", "line 3"),
        (HEADER + "0" * 140_000 + ",0,0,0\n", "field larger than field limit"),
    ],
)
def test_a_file_with_a_fault_is_refused_with_its_line(
    tmp_path: Path, text: str, found: str
) -> None:
    with pytest.raises(ValueError, match=r"path\.csv") as refused:
        path_of_file(written(tmp_path, text))
    assert found in str(refused.value)


def test_all_faults_are_listed_at_once_up_to_ten(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"path\.csv") as refused:
        path_of_file(written(tmp_path, HEADER + "0,0,0,0\n" + "1,a,0,0\n" * 30))
    assert str(refused.value).count("expected") == 10
    assert "20 more" in str(refused.value)


def test_a_file_that_is_not_there_or_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "path.csv"
    with pytest.raises(ValueError, match="No such file or directory; expected a CSV file"):
        path_of_file(path)
    path.write_bytes(b"t_s,\xff")
    with pytest.raises(ValueError, match="not UTF-8; expected a CSV file"):
        path_of_file(path)
