"""The lifecycle node of one robot, named after it in a namespace of its name.

    unconfigured --configure: its run answers--> inactive --activate: it is armed--> active
    active --deactivate: it is disarmed--> inactive --clean up--> unconfigured

rclpy keeps silent about what a transition raises: here each reason is logged, and the transition
fails.
"""

from collections.abc import Callable, Sequence

from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.links.robot_end import why_absent
from firmware_runtime.links.ros2.part import Part
from firmware_runtime.links.ros2.plan import Plan
from firmware_runtime.statistics.companions import Companion

SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


class NotThere(FirmwareRuntimeError):
    """There is no run to speak with."""


class RobotNode(LifecycleNode):  # type: ignore[misc] # rclpy has no types
    """The node; `parts` follow its transitions, in their order, backwards on the way down."""

    def __init__(self, plan: Plan) -> None:
        super().__init__(plan.node, namespace=f"/{plan.node}")
        self.plan = plan
        self.parts: list[Part] = []

    def on_configure(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Find the run, and make what needs it."""
        return self._done("configure", [self._find_run, *(part.configure for part in self.parts)])

    def on_activate(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Let commands through."""
        return self._done("activate", [part.activate for part in self.parts])

    def on_deactivate(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Let no command through."""
        return self._done("deactivate", [part.deactivate for part in reversed(self.parts)])

    def on_cleanup(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Remove what was made when it was configured."""
        return self._done("clean up", [part.clean_up for part in reversed(self.parts)])

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Let no command through, then the same."""
        self.on_deactivate(state)
        return self.on_cleanup(state)

    def leave(self) -> None:
        """Let no command through, and remove what was made; the process is about to end."""
        for part in reversed(self.parts):
            part.deactivate()
            part.clean_up()

    def _find_run(self) -> None:
        path = Companion.PORTS.beside(self.plan.statistics_path)
        if absent := why_absent(path):
            raise NotThere(f"{path}: no run listens ({absent}); expected one to be alive")

    def _done(self, what: str, steps: Sequence[Callable[[], None]]) -> TransitionCallbackReturn:
        """Take these steps; the first that raises ends it."""
        try:
            for step in steps:
                step()
        except FirmwareRuntimeError as error:
            self.get_logger().error(f"{what} refused: {error}")
            return FAILURE
        except Exception as error:  # noqa: BLE001 -- rclpy would drop it without a word
            self.get_logger().fatal(f"{what} failed: {type(error).__name__}: {error}")
            return TransitionCallbackReturn.ERROR
        return SUCCESS
