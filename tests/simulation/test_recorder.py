"""What a simulated walk's log says of contacts."""

from itertools import groupby

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from stribeck_simulation.walking.recorder import without_bounces


@given(st.lists(st.tuples(st.booleans(), st.integers(1, 9)), min_size=1, max_size=12), st.integers(1, 8))
def test_gaps_between_contacts_are_filled_if_they_are_short(runs: list[tuple[bool, int]], shortest: int) -> None:
    touching = np.concatenate([np.full(count, flag) for flag, count in runs])
    merged = [(flag, len(list(group))) for flag, group in groupby(touching.tolist())]
    expected = [
        np.full(count, flag or (0 < k < len(merged) - 1 and count < shortest)) for k, (flag, count) in enumerate(merged)
    ]
    found = without_bounces(touching[:, None], shortest)
    np.testing.assert_array_equal(found[:, 0], np.concatenate(expected))
