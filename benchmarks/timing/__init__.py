"""The executive's wake-up beside cyclictest's."""
