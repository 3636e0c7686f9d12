"""The words drivers speak: buses and the errors of the world. `linux` is the real back-end."""
