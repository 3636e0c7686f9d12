"""A robot's end of a link while datagrams flood its UDP port."""
