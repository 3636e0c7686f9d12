"""A board as a service of systemd: which files, where, and what is run to put them in force."""
