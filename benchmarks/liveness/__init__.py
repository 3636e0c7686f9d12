"""Whether sensors that live are ever taken for dead: hours of their noise through the checks."""
