"""The problem file: what may be asked, read and checked."""
