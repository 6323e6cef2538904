"""Contacts without flicker: raw flags switch several times when a foot lands or lifts."""

import numpy as np
import scipy  # its ndimage is slow to import: loaded at its first use

from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.dynamics.contact.phases import Segments


def without_flicker(
    standing: BoolArray, touching: BoolArray, time: Array, segments: Segments
) -> tuple[BoolArray, BoolArray]:
    """Remove short gaps and blips of contacts within each segment, shape (T, feet), and extend the feet that touch.

    A foot touches where it flickers around a change, and where a gap or blip is longer than noise makes it: it may have
    bounced.
    """
    # Longest gap or blip of a contact [s] that is removed: the fastest robots stand and swing for 0.06 s and more.
    flicker = 0.04
    # Longest gap or blip of a contact that noise of a sensor makes [s].
    blip = 0.01
    cleaned, uncertain = standing.copy(), touching.copy()
    for rows in segments:
        period = float(np.median(np.diff(time[rows]))) if rows.stop - rows.start > 1 else np.inf
        shortest, noise = round(flicker / period), np.ones((1 + round(blip / period), 1), dtype=bool)
        cleaned[rows] = _with_fewer_changes(standing[rows], shortest)
        changes, wrong = np.diff(cleaned[rows], axis=0, prepend=cleaned[rows][:1]), cleaned[rows] != standing[rows]
        near = scipy.ndimage.maximum_filter1d(changes, 2 * shortest + 1, axis=0)
        bounced = near | scipy.ndimage.binary_opening(wrong, noise)
        uncertain[rows] = _with_fewer_changes(touching[rows], shortest) | (wrong & bounced)
    return cleaned, uncertain


def _with_fewer_changes(standing: BoolArray, shortest: int) -> BoolArray:
    """Remove gaps and blips shorter than `shortest` rows from contacts, shape (T, feet).

    The result has the fewest rows that differ from `standing`, where each change counts as half of `shortest` rows
    (Potts functional). Raw flags flicker around touchdown, where it follows the majority.
    """
    contacts = standing.copy()
    for foot in range(standing.shape[1]):
        edges = np.flatnonzero(np.diff(standing[:, foot], prepend=~standing[:1, foot])).tolist()
        lengths = np.diff([*edges, len(standing)])
        if (lengths[1:-1] >= shortest).all():
            continue
        contacts[:, foot] = np.repeat(_fewest_changes(lengths.tolist(), bool(standing[0, foot]), shortest / 2), lengths)
    return contacts


def _fewest_changes(lengths: list[int], first: bool, price: float) -> list[bool]:
    """Choose the state of each run for the smallest cost, by dynamic programming (Viterbi).

    Runs alternate, starting with `first`. A changed run costs its length, and a change between runs `price` [rows].
    """
    cost, origins = (0.0, 0.0), []
    for number, length in enumerate(lengths):
        off, on = cost
        stands = first ^ bool(number % 2)
        changed = off > on + price, on > off + price
        cost = min(off, on + price) + length * stands, min(on, off + price) + length * (not stands)
        origins.append(changed)
    state, states = cost[1] < cost[0], []
    for changed in reversed(origins):
        states.append(state)
        state ^= changed[state]
    return states[::-1]
