"""Recordings (`blackbox`): their board, and the codec of their values.

header        which robot, by which settings, code and versions
of_board      that board again, also with other settings (`changed_settings`)
values        how a value is written, and made again (`value_writer`, `value_reader`, `records`)
code, versions, chance  what else a replay depends on
"""
