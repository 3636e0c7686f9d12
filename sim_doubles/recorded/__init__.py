"""A recorded run's lines, served to any program: each answers as it did, in the recorded order."""
