"""The process around a command: it outlives a crash, answers stops, and removes temporary files."""
