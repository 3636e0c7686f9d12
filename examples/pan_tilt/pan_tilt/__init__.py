"""PanTilt: a head on two servos that follows a light, by four photocells at an ADS1115."""
