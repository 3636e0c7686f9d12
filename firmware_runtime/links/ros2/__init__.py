"""The ROS 2 node of a running robot: a process of its own, with an interpreter of its own.

    verb `ros2` --starts--> interpreter of the ROS environment: `__main__`, `node` <--> the run

`interpreter` finds that environment and starts it with its libraries; it and `plan` are all that
the verb needs, and they import nothing of ROS. What imports rclpy is imported by `__main__` alone.
The node speaks with the run by the run's own sockets, so it can die without harm to it.
"""
