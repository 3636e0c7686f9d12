"""Campaigns of faults: which fault, at which moment, breaks this robot.

A mission is run healthy, and every use of its lines is noted. The space is each fault that fits at
each of these uses. A process runs the mission up to a use, and forks: the child makes the fault,
runs on until the judge is sure, and hands back one row. What goes wrong is a finding; equal ones
are one, made as short as they get, and saved as a recording and a test.
"""

from firmware_runtime.lab.campaign.again import assert_sound
from firmware_runtime.lab.campaign.campaigning import campaign

__all__ = ["assert_sound", "campaign"]
