"""Runs DEVS models as the firmware of a robot: formalism, executive, hardware words, telemetry."""
