"""What is proved of a mesh from the exact data of a problem: constants, and certificates that others can check."""
