"""What is written into a folder."""
