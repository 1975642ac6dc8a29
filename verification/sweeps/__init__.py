"""Runs over a grid of values: ``grid`` and ``sweep_file`` say which, ``row`` makes one of them, ``sweep`` all."""
