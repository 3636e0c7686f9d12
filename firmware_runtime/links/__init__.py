"""A run and other processes: what may be said to it, and what carries it where.

    ports/   values into a running model, and what its ports send: JSON datagrams on a Unix socket
    bridge/  the same over UDP, signed, by a process of its own
    cut/     the two ends of a model that is cut at its couplings: frames, peers, carriers
    dover/   the texts of the first paper's blocks, over UDP of this machine
    ros2/    the ROS 2 node, and the carrier of a cut over ROS 2

`control` takes requests to arm, disarm and set, and `key_file` reads what ends share.
"""
