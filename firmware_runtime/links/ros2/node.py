"""The lifecycle node of one robot, named after it in a namespace of its name.

    unconfigured --configure: its run answers--> inactive --activate: it is armed--> active
    active --deactivate: it is disarmed--> inactive --clean up--> unconfigured

An active node is an armed robot: one that is disarmed by anything else takes its node back to
inactive, and a run that is gone, or another, takes it back to unconfigured. The robot is armed on a
lease that the node renews, so it is disarmed when the node dies or hangs.

rclpy keeps silent about what a transition raises: here each reason is logged, and the transition
fails. A request for one that the state has not would end rclpy's executor: it is refused instead.
"""

from collections.abc import Callable, Sequence
from functools import partial
from time import monotonic_ns
from typing import Any, Final

from rclpy.clock import Clock, ClockType
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ControlError, FirmwareRuntimeError
from firmware_runtime.links.ros2.plan import Plan
from firmware_runtime.links.ros2.run_end import RunEnd

SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE
SIGNS: Final = 4
"""Signs of life in the time of a lease."""
ARM: Final = "arm"
"""The service; each node that has it is armed by a call of it."""
TEND_S: Final = 0.5
"""What becomes of the run is followed at least so often, however long the lease."""
STANDSTILL: Final = 2 * SECOND
"""A node that has not attended to its run for so long has stood still, ns."""
IN_DOUBT: Final = SECOND
"""For so long after that, what it handles may be from before, ns."""
CONFIGURE_EVERY: Final = SECOND
"""Of a node that configures itself, while the run refuses that, ns."""


class Refused(FirmwareRuntimeError):
    """The run does not do what a transition needs."""


class RobotNode(LifecycleNode):  # type: ignore[misc] # rclpy has no types
    """The node; `parts` follow its transitions, in their order, backwards on the way down."""

    def __init__(self, plan: Plan) -> None:
        super().__init__(plan.node, namespace=f"/{plan.node}")
        self.plan = plan
        self.parts: list[Part] = []
        self.run = RunEnd(plan.statistics_path)
        self.refusal = ""
        """Why the last transition was refused."""
        self._of_run = ""
        self._configure_at = 0
        self._looked_at, self._went_on_at = monotonic_ns(), -IN_DOUBT
        self._take_request = self._service_change_state.callback
        self._service_change_state.callback = self._change_state
        self.every(min(plan.lease_s / SIGNS, TEND_S), self._tend)

    @property
    def phase(self) -> str:
        """The state of the lifecycle: unconfigured, inactive, active, or one between."""
        return str(self._state_machine.current_state[1])

    @property
    def namesakes(self) -> str:
        """A sentence on other nodes in the domain that answer to its names; empty without any."""
        service = self.resolve_service_name(ARM)
        if self.count_services(service) <= 1:
            return ""
        return (
            f"another node of this domain has {service} too, so what is said to one robot is said "
            "to both; expected robots of different names, or --ros-args -r __ns:=/OTHER"
        )

    def every(self, seconds: float, call: Callable[[], None]) -> None:
        """Call again and again, by a clock that no participant of ROS can stop.

        That of a node is /clock once its parameter use_sim_time is set, which all may set.
        """
        self.create_timer(seconds, call, clock=Clock(clock_type=ClockType.STEADY_TIME))

    # Transitions ----------------------------------------------------------------------------------

    def _change_state(self, request: Any, response: Any) -> object:  # noqa: ANN401 -- ROS has no types
        """Answer a request for a transition; one by a number that the state has not is refused."""
        known = {number: label for number, label, *_ in self._state_machine.available_transitions}
        asked = request.transition
        if asked.label or asked.id in known:
            return self._take_request(request, response)
        names = ", ".join(known.values()) or "none"
        fault = f"transition {asked.id} refused: {self.phase} has no such one; expected {names}"
        self.get_logger().error(fault)
        response.success = False
        return response

    def on_configure(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Find the run, and make what needs it; what was made is removed if something fails."""
        result = self._done("configure", [self._find_run, *(part.configure for part in self.parts)])
        if result is not SUCCESS:
            self._clean_up()
        return result

    def on_activate(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Arm, and let commands through; disarm if something fails."""
        result = self._done("activate", [self._arm, *(part.activate for part in self.parts)])
        if result is not SUCCESS and self.run.lease is not None:
            self._let_go()
        return result

    def on_deactivate(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Let no command through, and disarm."""
        self._let_go()
        return SUCCESS

    def on_cleanup(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Remove what was made when it was configured."""
        self._clean_up()
        return SUCCESS

    def on_shutdown(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Disarm what was armed here, and remove what was made."""
        self.leave()
        return SUCCESS

    def on_error(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Disarm, and begin again from unconfigured."""
        self.leave()
        return SUCCESS

    def leave(self) -> None:
        """Disarm what was armed here, and remove what was made; the node may be used again."""
        if self.phase == "active" or self.run.lease is not None:
            self._let_go()
        self._clean_up()

    # ----------------------------------------------------------------------------------------------

    def _find_run(self) -> None:
        self._of_run = self.run.find().run
        self.run.tend()

    def _arm(self) -> None:
        if namesakes := self.namesakes:
            raise Refused(namesakes)
        if self.has_stood_still():
            raise Refused(
                "this node has just stood still, so the request may be from before; "
                "expected another one"
            )
        if refused := self.run.arm(self.plan.lease_s):
            raise Refused("; ".join(refused))

    def _let_go(self) -> None:
        """Let no command through, and disarm; what is wrong with that is logged."""
        for part in reversed(self.parts):
            self._done("deactivate", [part.deactivate])
        try:
            answer = self.run.disarm()
        except ControlError as error:
            self.get_logger().warning(f"not disarmed by this node: {error}")
            return
        for sentence in answer.get("not_safe", ()):
            self.get_logger().error(f"not made safe: {sentence}")
        for sentence in answer.get("refused", ()):
            self.get_logger().info(f"not disarmed: {sentence}")

    def _clean_up(self) -> None:
        for part in reversed(self.parts):
            self._done("clean up", [part.clean_up])

    def _done(self, what: str, steps: Sequence[Callable[[], None]]) -> TransitionCallbackReturn:
        """Take these steps; the first that raises ends it, and `refusal` says why."""
        try:
            for step in steps:
                step()
        except FirmwareRuntimeError as error:
            self.refusal = str(error)
            self.get_logger().error(f"{what} refused: {error}")
            return FAILURE
        except Exception as error:  # noqa: BLE001 -- rclpy would drop it without a word
            self.refusal = f"{type(error).__name__}: {error}"
            self.get_logger().fatal(f"{what} failed: {self.refusal}")
            return TransitionCallbackReturn.ERROR
        return SUCCESS

    # The run, watched -----------------------------------------------------------------------------

    def has_stood_still(self) -> bool:
        """Return whether this process has just stood still: what it handles may be old."""
        now = monotonic_ns()
        if now - self._looked_at > STANDSTILL:
            self._went_on_at = now
        self._looked_at = now
        return now - self._went_on_at < IN_DOUBT

    def _tend(self) -> None:
        """Give the sign of life, and follow what becomes of the run."""
        self.has_stood_still()
        self.run.tend()
        seen, phase = self.run.seen, self.phase
        if phase == "finalized":
            return
        if phase == "unconfigured":
            if self.plan.configures_itself and seen is not None:
                self._configure_itself()
        elif seen is None or seen.run != self._of_run:
            self._lose_run(phase, self.run.why_gone if seen is None else "another run has begun")
        elif phase == "active" and self.run.has_lost_robot:
            self.get_logger().error(f"the robot was disarmed: {seen.reason or 'its lease ran out'}")
            self.trigger_deactivate()
        else:
            for part in self.parts:
                self._done("follow", [partial(part.follow, seen.revision)])

    def _configure_itself(self) -> None:
        if (now := monotonic_ns()) >= self._configure_at:
            self._configure_at = now + CONFIGURE_EVERY
            self.trigger_configure()

    def _lose_run(self, phase: str, why: str) -> None:
        self.get_logger().error(f"the run is gone: {why}")
        self.run.lease = None
        if phase == "active":
            self.trigger_deactivate()
        self.trigger_cleanup()


class Part:
    """Parameters, topics: made when the node is configured, gone when it is cleaned up.

    Each of these may raise FirmwareRuntimeError: then the transition fails, with its sentence.
    """

    def configure(self) -> None:
        """The run is there: make publishers, subscribers, parameters."""

    def activate(self) -> None:
        """The robot is armed from now on: let commands through."""

    def deactivate(self) -> None:
        """The robot is about to be disarmed, or is: let no command through."""

    def clean_up(self) -> None:
        """Remove what `configure` made, as far as it was; also called if it had failed."""

    def follow(self, revision: int) -> None:
        """Called again and again while configured; `revision` counts changes of the settings."""
