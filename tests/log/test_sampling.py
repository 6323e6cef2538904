"""Sampling: no value is invented or depends on samples across a gap. Interpolation, and samples that logs share."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp
from tests.log.readers.formats import synthetic_log

from stribeck.core.errors import LogError
from stribeck.core.log import RobotLog
from stribeck.core.log.interpolation import bridges, cubic, linear, previous, slerp
from stribeck.core.log.overlap import prints, refuse_overlap
from stribeck.core.log.sampling import regularise
from stribeck.core.settings import LogTable

TABLE = LogTable()


def motion(time):
    """Compute smooth joints, their velocities, and torques linear in time."""
    phase = np.array([0.0, 1.0, 2.0])
    return {
        "position": np.sin(5 * time[:, None] + phase),
        "velocity": 5 * np.cos(5 * time[:, None] + phase),
        "torque": time[:, None] * np.array([1.0, 2.0, -3.0]) + 1,
    }


def log_at(time, **channels):
    """Make a log of the motion above at these times, without other channels."""
    return RobotLog(time=time, joint_names=("hip", "knee", "wheel"), path="walk.npz", **(motion(time) | channels))


def test_a_regular_log_is_unchanged():
    log = synthetic_log(500)
    same, sampling = regularise(log, TABLE)
    assert same is log
    assert sampling.segments == (slice(0, 500),)
    assert sampling.rate == pytest.approx(500)
    assert sampling.period == pytest.approx(0.002)
    assert sampling.jitter < 1e-9
    assert (sampling.gaps, sampling.duplicates, sampling.missing, sampling.notes) == ((), 0, {}, ())


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_incomplete_rows_are_cut_out_and_counted_by_joint(bad):
    time = np.arange(400) / 1000
    log = log_at(time)
    log.torque[100:110, 1] = bad
    log.position[105:120, 2] = bad
    log.time[200] = bad
    even, sampling = regularise(log, TABLE)
    assert sampling.missing == {"time": 1, "position.wheel": 15, "torque.knee": 10}
    assert len(even.time) == 400 - 20
    assert sampling.segments == (slice(0, 100), slice(100, 380))
    for name, exact in motion(even.time).items():
        np.testing.assert_allclose(getattr(even, name), exact, atol=1e-9)
    assert any("21 rows with missing values" in note and "position.wheel (15)" in note for note in sampling.notes)


@settings(max_examples=40)
@given(seed=st.integers(0, 1000), share=st.floats(0.05, 0.2))
def test_jitter_is_interpolated_away(seed, share):
    rng = np.random.default_rng(seed)
    time = (np.arange(600) + rng.uniform(-share, share, 600)) / 1000
    even, sampling = regularise(log_at(time), TABLE)
    steps = np.diff(even.time)
    np.testing.assert_allclose(steps, sampling.period, rtol=1e-9)
    assert sampling.period == pytest.approx(1e-3, rel=1e-3)
    assert sampling.jitter == pytest.approx(np.abs(np.diff(time) - sampling.period).max())
    exact = motion(even.time)
    np.testing.assert_allclose(even.position, exact["position"], atol=1e-9)
    np.testing.assert_allclose(even.velocity, exact["velocity"], atol=1e-8)
    np.testing.assert_allclose(even.torque, exact["torque"], atol=1e-12)
    assert any("interpolated to" in note for note in sampling.notes)


def test_segments_are_interpolated_independently():
    rng = np.random.default_rng(0)
    time = (np.arange(400) + rng.uniform(-0.1, 0.1, 400)) / 1000
    time[200:] += 0.5
    log = log_at(time)
    other = replace(log, position=log.position + np.where(np.arange(400) >= 200, 1000.0, 0)[:, None])
    even, sampling = regularise(log, TABLE)
    moved, _ = regularise(other, TABLE)
    first, second = sampling.segments
    np.testing.assert_array_equal(even.position[first], moved.position[first])
    np.testing.assert_allclose(even.position[second], moved.position[second] - 1000, atol=1e-9)
    assert even.time[first][-1] <= time[199]
    assert even.time[second][0] == time[200]


def test_every_kind_of_channel_is_interpolated_in_its_own_way():
    log = synthetic_log(300)
    late = log.time + 0.0002 * np.sin(7 * np.arange(300))
    exact = replace(synthetic_log(300), position=motion(late)["position"])
    tilt = 0.2 * np.sin(2 * late)
    zero = np.zeros(300)
    turned = np.stack([np.sin(tilt / 2), zero, zero, np.cos(tilt / 2)], axis=1)
    turned[::2] *= -1  # the same orientation
    even, _ = regularise(replace(exact, time=late, base_orientation=turned), TABLE)
    tilt = 0.2 * np.sin(2 * even.time)
    np.testing.assert_allclose(np.abs(even.base_orientation[:, 0]), np.abs(np.sin(tilt / 2)), atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(even.base_orientation, axis=1), 1)
    rows = np.searchsorted(late, even.time, side="right") - 1
    np.testing.assert_array_equal(even.contact, exact.contact[np.maximum(rows, 0)])
    assert even.contact.dtype == bool
    assert even.foot_wrench.shape == (len(even.time), 2, 6)


def test_rounded_stamps_are_evened_and_values_unchanged():
    true = np.arange(500) / 400  # 2.5 ms, logged in whole milliseconds
    log = log_at(true)
    even, sampling = regularise(replace(log, time=np.round(true, 3)), LogTable(max_gap=0.005))
    np.testing.assert_allclose(even.time, true, atol=0.0006)
    np.testing.assert_allclose(np.diff(even.time), sampling.period)
    assert even.position is log.position
    assert any("rounded to 1 ms" in note for note in sampling.notes)


def test_max_gap_allows_longer_steps():
    time = np.delete(np.arange(300) / 1000, [50, 51, 120])
    _, split = regularise(log_at(time), LogTable(max_gap=0.0015))
    whole, joined = regularise(log_at(time), TABLE)
    assert len(split.segments) == 3
    assert joined.segments == (slice(0, len(whole.time)),)
    assert joined.rate == pytest.approx(1000)  # not that of the samples that came through
    assert len(whole.time) == 300
    np.testing.assert_allclose(whole.position, motion(whole.time)["position"], atol=1e-6)


def wall_clock(generator, rows=4000):
    """Make stamps of a scheduler at 1 kHz: each slightly late, one of fifty by up to four periods, none missing."""
    late = 5e-5 * np.abs(generator.standard_t(3, rows))
    late += (generator.random(rows) < 0.02) * generator.uniform(0, 4e-3, rows)
    due = 1e-3 * np.arange(rows)
    stamps = due + late
    for row in range(1, rows):
        stamps[row] = max(due[row] + (late[row] if late[row] > 1e-3 else 5e-5), stamps[row - 1] + 8e-5)
    return due, stamps


def test_a_wall_clock_that_jitters_loses_no_samples():
    """The motion shows whether samples were taken at uneven times, or evenly and stamped late."""
    due, stamps = wall_clock(np.random.default_rng(1))
    assert np.mean(np.diff(stamps) > 1.5e-3) > 0.01
    uneven, sampling = regularise(log_at(stamps), TABLE)
    assert (len(sampling.segments), sampling.gaps, sampling.lost) == (1, (), 0.0)
    np.testing.assert_allclose(uneven.position, motion(uneven.time)["position"], atol=1e-6)
    late, sampling = regularise(replace(log_at(due), time=stamps), TABLE)
    assert (len(late.time), sampling.lost) == (len(due), 0.0)
    assert sampling.rate == pytest.approx(1000, rel=1e-4)
    np.testing.assert_array_equal(late.position, log_at(due).position)
    np.testing.assert_allclose(late.time - due, np.mean(stamps - due), atol=1e-4)


def test_parts_that_gaps_leave_too_short_are_counted():
    time = np.arange(1000) / 1000 + 0.02 * (np.arange(1000) // 50 * (np.arange(1000) < 500))
    _, sampling = regularise(log_at(time + np.where(np.arange(1000) >= 500, 0.2, 0)), TABLE)
    assert sampling.lost == pytest.approx(0.5)
    assert any("50 % of the samples are not used" in note for note in sampling.notes)


def test_channels_beyond_the_memory_limit_are_cut_and_interpolated_on_disk(monkeypatch):
    rng = np.random.default_rng(0)
    time = (np.arange(400) + rng.uniform(-0.1, 0.1, 400)) / 1000
    log = log_at(time)
    log.torque[3, 0] = np.nan
    expected, _ = regularise(log, TABLE)
    monkeypatch.setattr("stribeck.core.log.storage.IN_MEMORY_LIMIT", 1000)
    even, _ = regularise(log, TABLE)
    for name, channel in expected.channels().items():
        np.testing.assert_array_equal(even.channels()[name], channel)


def test_suspicions_are_notes():
    log = synthetic_log(300)
    turned = replace(log, base_orientation=log.base_orientation[:, [3, 0, 1, 2]])
    assert any("wxyz" in note for note in regularise(turned, TABLE)[1].notes)
    wheels = replace(log, velocity=None, position=40 * log.time[:, None] * np.array([1, 2, 3.0]))
    assert any("'wheel' span more than four turns" in note for note in regularise(wheels, TABLE)[1].notes)
    mirrored = replace(log, velocity=log.velocity * [1, -1, 1])
    assert any("opposite signs in 'knee'" in note for note in regularise(mirrored, TABLE)[1].notes)


def test_zeros_of_a_second_publisher_are_dropped_and_a_robot_at_zero_is_not():
    log = log_at(np.arange(400) / 400)
    ghost = np.arange(400) % 11 == 5
    read, sampling = regularise(replace(log, position=np.where(ghost[:, None], 0.0, log.position + 1.0)), LogTable())
    assert sampling.missing == {"all positions zero": int(ghost.sum())}
    assert read.position.min() > -0.5
    rests = 0.01 * np.maximum(0.0, np.arange(400) - 199)[:, None] ** 2 / 400
    _, sampling = regularise(replace(log, position=rests + 0 * log.position), LogTable())
    assert sampling.missing == {}


def test_repeated_stamps_are_dropped_and_counted():
    time = np.repeat(np.arange(300) / 1000, np.where(np.arange(300) % 50 == 7, 2, 1))
    even, sampling = regularise(log_at(time), TABLE)
    assert sampling.duplicates == 6
    np.testing.assert_allclose(even.time, np.arange(300) / 1000)
    np.testing.assert_array_equal(even.position, motion(even.time)["position"])


TIME = np.array([0.0, 0.1, 0.25, 0.3, 0.6])
RNG = np.random.default_rng(0)


@pytest.mark.parametrize("method", [linear, cubic, previous])
def test_samples_are_met(method):
    values = RNG.normal(size=(5, 3))
    np.testing.assert_allclose(method(TIME, TIME, values), values, atol=1e-12)
    np.testing.assert_allclose(method(np.array([-1.0, 2.0]), TIME, values), values[[0, -1]], atol=1e-12)


def test_polynomials_are_met_up_to_the_order_of_the_method():
    query = np.linspace(0, 0.6, 50)
    line = lambda t: np.stack([1 + 2 * t, -t], axis=1)  # noqa: E731
    cube = lambda t: np.stack([t**3 - t, 2 * t**2], axis=1)  # noqa: E731
    np.testing.assert_allclose(linear(query, TIME, line(TIME)), line(query), atol=1e-12)
    np.testing.assert_allclose(cubic(query, TIME, cube(TIME)), cube(query), atol=1e-12)


def test_orientations_turn_at_constant_speed_the_short_way():
    rotations = Rotation.random(5, rng=1)
    quaternions = rotations.as_quat() * np.array([1, -1, 1, 1, -1])[:, None]
    query = np.linspace(0, 0.6, 40)
    ours = Rotation.from_quat(slerp(query, TIME, quaternions))
    assert (ours.inv() * Slerp(TIME, rotations)(query)).magnitude().max() < 1e-7


def test_bridges_are_between_samples_too_far_apart_and_outside():
    query = np.array([-0.1, 0.0, 0.05, 0.2, 0.3, 0.4, 0.6, 0.7])
    expected = [True, False, False, False, False, True, False, True]
    np.testing.assert_array_equal(bridges(query, TIME, 0.2), expected)


def test_blocks_leave_no_seams(monkeypatch):
    time = np.cumsum(RNG.uniform(0.5, 1.5, 2000))
    query = np.sort(RNG.uniform(time[0], time[-1], 1500))
    values, turns = RNG.normal(size=(2000, 3)), Rotation.random(2000, rng=2).as_quat()
    whole = cubic(query, time, values), slerp(query, time, turns)
    monkeypatch.setattr("stribeck.core.log.interpolation.BLOCK_ROWS", 100)
    np.testing.assert_allclose(cubic(query, time, values), whole[0], atol=1e-12)
    np.testing.assert_array_equal(slerp(query, time, turns), whole[1])


def noisy(seed, samples=4000):
    log = synthetic_log(samples)
    return replace(log, position=log.position + np.random.default_rng(seed).normal(0, 1e-4, log.position.shape))


def refuse(own, other):
    refuse_overlap(prints(own), "b.npz", [(prints(other), "a.npz")])


@pytest.mark.parametrize("rows", [slice(None), slice(3000, None), slice(1000, 2000)])
def test_samples_given_twice(rows):
    log = noisy(1)
    part = log.take(rows)
    for other in (part, replace(part, time=part.time - part.time[0] + 1e6)):
        with pytest.raises(LogError, match=r"b\.npz: .* % of its samples are also in a\.npz; use each"):
            refuse(other, log)


def test_halves_that_overlap_a_little():
    log = noisy(1)
    with pytest.raises(LogError, match="2 % of its samples"):
        refuse(log.take(slice(1900, None)), log.take(slice(0, 2000)))
    refuse(log.take(slice(1990, None)), log.take(slice(0, 2000)))  # some messages that a recorder repeated


def test_a_joint_that_repeats_itself_and_whose_signals_are_coarse():
    rng = np.random.default_rng(3)
    time = np.arange(20_000) / 1000
    logs = []
    for _ in range(2):
        log = synthetic_log(len(time), joints=("hip",))
        position = np.round(np.sin(2 * np.pi * time)[:, None] * 650) / 650
        torque = np.round((np.cos(2 * np.pi * time)[:, None] + rng.normal(0, 0.02, (len(time), 1))) * 100) / 100
        logs.append(replace(log, position=position, torque=torque))
    refuse(*logs)


def test_standing_still_is_no_overlap():
    still = synthetic_log(3000)
    still = replace(still, position=np.zeros((3000, 3)), torque=np.ones((3000, 3)))
    assert len(prints(still)) == 0
    refuse(still, still)
