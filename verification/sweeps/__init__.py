"""Runs over a grid of values: ``grid`` reads it, ``row`` makes one of its rows, ``sweep`` all."""
