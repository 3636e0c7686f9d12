"""What /proc and /sys tell about the machine and the calling process; nothing is changed."""
