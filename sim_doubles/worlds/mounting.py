"""Turns what a body feels into what a chip feels that is mounted askew in it."""

from msgspec.structs import replace

from sim_doubles.inertial_truth import BodyMotion, InertialTruth, Vector


class ChipAxes:
    """A mounting such as `+y -x +z`: the chip's axes that lie along body x, y and z, in order."""

    def __init__(self, mounting: str) -> None:
        self._from_body: list[tuple[int, float]] = [(0, 1.0), (1, 1.0), (2, 1.0)]
        for body_axis, word in enumerate(mounting.split()):
            sign = -1.0 if word[0] == "-" else 1.0
            self._from_body["xyz".index(word[1])] = (body_axis, sign)
        self.is_identity = self._from_body == [(0, 1.0), (1, 1.0), (2, 1.0)]

    def turn(self, truth: InertialTruth) -> InertialTruth:
        """The same truth in the chip's axes."""
        if self.is_identity:
            return truth
        return replace(
            truth,
            acceleration=self.turn_vector(truth.acceleration),
            rate=self.turn_vector(truth.rate),
            field=self.turn_vector(truth.field),
        )

    def turn_motion(self, motion: BodyMotion) -> BodyMotion:
        """The same motion in the chip's axes."""
        if self.is_identity:
            return motion
        acceleration, rate = self.turn_vector(motion.acceleration), self.turn_vector(motion.rate)
        return BodyMotion(acceleration, rate, motion.temperature_c)

    def turn_vector(self, vector: Vector) -> Vector:
        """One vector in the chip's axes."""
        if self.is_identity:
            return vector
        x, y, z = (sign * vector[axis] for axis, sign in self._from_body)
        return (x, y, z)
