"""The sections of constants, bounds, runs, histories and comparisons: what a screen, a notebook and a report show."""
