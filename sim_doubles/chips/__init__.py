"""One chip a module: registers in front, SI values behind."""
