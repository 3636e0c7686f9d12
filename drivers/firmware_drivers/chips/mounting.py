"""Mounting of a sensor in the body: a signed permutation of its axes, such as `+x +y +z`."""

from typing import Final, NamedTuple, TypeAlias

from firmware_runtime.errors import SettingError

Vector: TypeAlias = tuple[float, float, float]

_AXES: Final = {"x": 0, "y": 1, "z": 2}
_SIGNS: Final = {"+": 1, "-": -1}
_EVEN: Final = {(0, 1, 2), (1, 2, 0), (2, 0, 1)}


class Mounting(NamedTuple):
    """Body axis i is `signs[i]` times sensor axis `axes[i]`."""

    axes: tuple[int, int, int]
    signs: tuple[int, int, int]

    def of(self, inner: "Mounting") -> "Mounting":
        """Compose: the mounting of a part that is mounted by `inner` in what this one mounts."""
        i, j, k = self.axes
        si, sj, sk = self.signs
        return Mounting(
            (inner.axes[i], inner.axes[j], inner.axes[k]),
            (si * inner.signs[i], sj * inner.signs[j], sk * inner.signs[k]),
        )

    def factors(self, per_sensor_axis: Vector) -> Vector:
        """Give the signed factor of each body axis from the scale of each sensor axis."""
        (i, j, k), (si, sj, sk) = self
        return (si * per_sensor_axis[i], sj * per_sensor_axis[j], sk * per_sensor_axis[k])


def parse_mounting(text: str) -> Mounting:
    """Read the sensor axes that lie along body x, y and z, in this order.

    `+y -x +z`: the sensor's y axis points along body x, its x axis against body y.
    Each axis stands once, with a sign, and the whole is a rotation: a mirror image is refused.
    """
    words = text.split(" ")
    well_formed = len(words) == 3 and all(
        len(word) == 2 and word[0] in _SIGNS and word[1] in _AXES for word in words
    )
    if not well_formed or len({word[1] for word in words}) != 3:
        raise SettingError(
            f"{text!r}",
            where="mounting",
            expected="each of x, y, z once with a sign, such as '+x +y +z'",
        )
    x, y, z = (_AXES[word[1]] for word in words)
    sx, sy, sz = (_SIGNS[word[0]] for word in words)
    handedness = 1 if (x, y, z) in _EVEN else -1
    if handedness * sx * sy * sz != 1:
        raise SettingError(f"{text!r} is a mirror image", where="mounting", expected="a rotation")
    return Mounting((x, y, z), (sx, sy, sz))
