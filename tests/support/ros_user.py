"""A node of a test's own: calls services, sets parameters, listens; every wait has a bound."""

from collections.abc import Callable
from time import monotonic
from typing import Any

import rclpy
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.executors import SingleThreadedExecutor

from tests.support.waiting import PATIENCE_S


class RosUser:
    """A node in a context of its own."""

    def __init__(self) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node("user", context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)

    def close(self) -> None:
        """Leave."""
        self.executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()

    def call(self, kind: Any, name: str, **fields: object) -> Any:  # noqa: ANN401 -- ROS has no types
        """Call a service once it is there; its response."""
        client = self.node.create_client(kind, name)
        assert client.wait_for_service(PATIENCE_S), f"no service {name}"
        future = client.call_async(kind.Request(**fields))
        self.executor.spin_until_future_complete(future, PATIENCE_S)
        self.node.destroy_client(client)
        assert future.done(), f"no answer from {name}"
        return future.result()

    def change(self, node: str, transition: str) -> bool:
        """Whether a transition of a node's lifecycle succeeded, such as `configure`."""
        request = ChangeState.Request().transition
        request.label = transition
        changed = self.call(ChangeState, f"{node}/change_state", transition=request)
        return bool(changed.success)

    def change_by_number(self, node: str, number: int) -> bool:
        """The same by the number of lifecycle_msgs/Transition, as launch files ask."""
        request = ChangeState.Request().transition
        request.id = number
        changed = self.call(ChangeState, f"{node}/change_state", transition=request)
        return bool(changed.success)

    def state(self, node: str) -> str:
        """The state of a node's lifecycle."""
        return str(self.call(GetState, f"{node}/get_state").current_state.label)

    def spin_until(self, true: Callable[[], bool], what: str) -> None:
        """Handle what comes until something holds."""
        give_up_at = monotonic() + PATIENCE_S
        while not true():
            assert monotonic() < give_up_at, f"not within {PATIENCE_S} s: {what}"
            self.executor.spin_once(timeout_sec=0.05)
