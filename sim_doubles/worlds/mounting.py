"""Turns what a body feels into what a chip feels that is mounted askew in it."""

from sim_doubles.inertial_truth import InertialTruth

Vector = tuple[float, float, float]


class ChipAxes:
    """A mounting such as `+y -x +z`: the chip's axes that lie along body x, y and z, in order."""

    def __init__(self, mounting: str) -> None:
        self._from_body: list[tuple[int, float]] = [(0, 1.0), (1, 1.0), (2, 1.0)]
        for body_axis, word in enumerate(mounting.split()):
            sign = -1.0 if word[0] == "-" else 1.0
            self._from_body["xyz".index(word[1])] = (body_axis, sign)
        self._is_identity = self._from_body == [(0, 1.0), (1, 1.0), (2, 1.0)]

    def turn(self, truth: InertialTruth) -> InertialTruth:
        """The same truth in the chip's axes."""
        if self._is_identity:
            return truth
        return truth._replace(
            acceleration=self._turned(truth.acceleration),
            rate=self._turned(truth.rate),
            field=self._turned(truth.field),
        )

    def _turned(self, vector: Vector) -> Vector:
        x, y, z = (sign * vector[axis] for axis, sign in self._from_body)
        return (x, y, z)
