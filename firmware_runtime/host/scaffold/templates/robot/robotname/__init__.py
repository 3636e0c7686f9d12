"""RobotName: a robot of one motor and one sonar that keeps its distance from a wall."""
