"""What the store of a sweep has, by SQL."""

import sqlite3
from contextlib import closing


def read(place, question):
    """The rows of an answer."""
    with closing(sqlite3.connect(place)) as file:
        return file.execute(question).fetchall()
