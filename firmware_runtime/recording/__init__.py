"""Recordings: what entered a run at its edge, and all that is made of it by running it again.

recorded_board, board_of_recording  which robot, by which settings and code; that board again
values    how a value is written and made again (`value_writer`, `value_reader`, `records`)
classes   the classes of what was sent, which MessagePack does not tell
blackbox  writer, ring and reader; state of a robot; lists of recordings, and what is kept of them
replay    the one player, which replays, what-ifs, exports and the debugger drive
"""
