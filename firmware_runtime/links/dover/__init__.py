"""What the blocks of the first paper say, as texts over UDP of this machine."""
