"""One run put together: a robot's session, its arming, and requests from other processes.

`session` makes lines, robot and executive of a board, and every way to run one goes through it.
`arming` decides whether outputs may be driven, `guard` and `safe_state` switch them off from
another process, `requests` answers them, `reporter` and `restarts` speak to systemd.
"""
