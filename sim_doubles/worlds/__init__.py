"""Plants: what the motors behind the doubles do to the world the sensors feel."""
