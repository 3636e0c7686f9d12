"""DOVER: texts of the first paper's blocks, over UDP of this machine."""
