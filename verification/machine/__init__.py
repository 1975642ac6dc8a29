"""The process on its machine: threads, signals, progress."""
