"""Doubles behind a real `/dev/i2c-N`: USB adapters that this machine finds plugged in."""
