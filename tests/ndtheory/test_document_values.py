"""Values of documents."""

import json

import numpy as np

from ndtheory.keys import plain


def test_numbers_that_are_not_finite_are_null_in_arrays_too():
    values = {"x": np.array([1.0, np.nan, -np.inf]), "alone": np.float32("nan"), "count": np.int64(3), "is": np.True_}
    text = json.dumps(plain(values), allow_nan=False)
    assert json.loads(text) == {"x": [1.0, None, None], "alone": None, "count": 3, "is": True}
