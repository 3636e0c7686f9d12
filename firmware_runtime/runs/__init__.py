"""What makes a run a service: arming, the guard, notices to systemd, the journal, installation."""
