"""The parts of results as data: what a terminal, a notebook and the written report lay out."""
