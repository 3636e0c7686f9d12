"""Statistics as Prometheus reads them. Needs the extra `metrics`; no run ever imports it."""
