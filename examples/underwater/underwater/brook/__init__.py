"""The Brook, a flow meter on a serial line (example, rev. 1)."""
