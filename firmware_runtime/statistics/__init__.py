"""What a run tells about itself: the statistics file, its writer, and its readers."""
