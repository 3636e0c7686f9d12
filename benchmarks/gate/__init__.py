"""How often the timing gate is wrong, beside busy neighbours."""
