"""Properties of position filters of any kind, and the choice of the cutoff from the spectrum."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import sosfreqz

from stribeck.core.errors import SettingsError
from stribeck.core.filters import make_filter, resolve_auto, savgol_cutoff, savgol_kernels, savgol_window
from stribeck.core.filters.savitzky_golay import correlate_valid
from stribeck.core.settings import FilterSettings
from stribeck.paper.filters.butterworth import SETTLED, butterworth_sections
from stribeck.paper.filters.cutoff import average_spectra, choose_cutoff

PERIOD = 0.002
RATE = 1 / PERIOD
SAVGOL = FilterSettings(kind="savitzky-golay", window=15, order=4)
BUTTERWORTH = FilterSettings(kind="butterworth", cutoff=30.0, order=4)
BUTTERWORTHS = [BUTTERWORTH.model_copy(update={"cutoff": c, "order": n}) for c in (5.0, 30.0, 150.0) for n in (2, 4, 6)]
every_filter = pytest.mark.parametrize("choice", [SAVGOL, BUTTERWORTH], ids=lambda choice: choice.kind)


def walk(samples: int = 2000, joints: int = 3, seed: int = 0) -> np.ndarray:
    """Make a random signal with power at all frequencies."""
    return np.cumsum(np.random.default_rng(seed).standard_normal((samples, joints)), axis=0) * 0.01


def scale(array: np.ndarray) -> float:
    return float(np.abs(array).max())


windows = st.integers(2, 40).flatmap(
    lambda half: st.tuples(st.just(2 * half + 1), st.integers(2, min(2 * half, 8)))
)  # (window, order)


class TestSavitzkyGolay:
    @given(windows)
    @settings(max_examples=40)
    def test_kernels_reproduce_polynomials_and_their_derivatives(self, shape):
        window, order = shape
        rng = np.random.default_rng(window)
        polynomial = np.polynomial.Polynomial(rng.standard_normal(order + 1), domain=[0, 0.5])
        time = np.arange(250) * PERIOD
        kernels = savgol_kernels(window, order, PERIOD)
        filtered = correlate_valid(polynomial(time)[:, None], kernels, (0, 1, 2))
        middle = time[window // 2 : len(time) - window // 2]
        for d, result in enumerate(filtered):
            # A derivative of double precision numbers cannot be better than their last digit over the taps.
            rounding = 1e-15 * np.abs(kernels[d]).sum() * scale(polynomial(time))
            expected = polynomial.deriv(d)(middle) if d else polynomial(middle)
            np.testing.assert_allclose(result[:, 0], expected, rtol=1e-9, atol=1e-9 * scale(expected) + rounding)
            np.testing.assert_array_equal(kernels[d], (-1) ** d * kernels[d][::-1])

    @pytest.mark.parametrize("order", [2, 3, 4, 6])
    def test_cutoff_is_where_half_the_power_of_a_sine_is_left(self, order):
        cutoff = savgol_cutoff(41, order, RATE)
        time = np.arange(41) - 20
        gain = savgol_kernels(41, order, PERIOD)[0] @ np.cos(2 * np.pi * cutoff * PERIOD * time)
        assert gain**2 == pytest.approx(0.5, rel=1e-9)
        assert savgol_cutoff(5, 4, RATE) == RATE / 2  # a polynomial through all samples does not smooth

    @given(st.integers(3, 200), st.integers(2, 5))
    @settings(max_examples=30)
    def test_window_and_cutoff_are_inverse(self, half_width, order):
        window = 2 * half_width + 1
        cutoff = savgol_cutoff(window, order, RATE)
        if cutoff < RATE / 2:
            assert savgol_window(cutoff, order, RATE) == window
            assert savgol_window(cutoff * 1.0001, order, RATE) <= window


@every_filter
@pytest.mark.parametrize("spare", [-5, -1, 0, 1, 200])
def test_ramps_come_out_but_for_the_edges(choice, spare):
    motion_filter = make_filter(choice, PERIOD)
    h = motion_filter.half_width
    ramp = np.arange(max(2.0 * h + spare, 0))[:, None] * [PERIOD, -3 * PERIOD]
    found, rows = motion_filter.apply(ramp), max(spare, 0)
    assert [signal.shape for signal in found] == [(rows, 2)] * 3
    np.testing.assert_allclose(found[0], ramp[h : h + rows], atol=1e-6)
    np.testing.assert_allclose(found[1], np.broadcast_to([1.0, -3.0], (rows, 2)), atol=1e-5)
    np.testing.assert_allclose(found[2], 0.0, atol=1e-5)


@pytest.mark.parametrize("choice", [SAVGOL, *BUTTERWORTHS], ids=str)
def test_overlapping_chunks_are_the_whole(choice):
    """Signals before and after a chunk must not affect the samples that it keeps."""
    motion_filter, signal, chunk = make_filter(choice, PERIOD), walk(4000), 700
    h, whole = motion_filter.half_width, motion_filter.apply(signal)
    pieces = [motion_filter.apply(signal[k : k + chunk + 2 * h]) for k in range(0, len(signal) - 2 * h, chunk)]
    assert len(pieces) > 1
    # A Butterworth filter never forgets wholly, but no more than `SETTLED` of what it met at the edges.
    tolerance = 10 * SETTLED if choice.kind == "butterworth" else 1e-9
    for d in range(3):
        joined = np.concatenate([piece[d] for piece in pieces])
        np.testing.assert_allclose(joined, whole[d], atol=tolerance * scale(signal) / PERIOD**d)


@every_filter
def test_time_reversal_inverts_only_the_velocity(choice):
    motion_filter = make_filter(choice, PERIOD)
    position, velocity, acceleration = motion_filter.apply(walk())
    back = motion_filter.apply(walk()[::-1])
    tolerance = SETTLED if choice.kind == "butterworth" else 1e-12
    for d, (forward, reverse) in enumerate(zip((position, -velocity, acceleration), back, strict=True)):
        np.testing.assert_allclose(reverse[::-1], forward, atol=10 * tolerance * scale(walk()) / PERIOD**d)


@pytest.mark.parametrize("order", [1, 2, 4, 6])
@pytest.mark.parametrize("cutoff", [3.0, 30.0, 200.0])
def test_both_passes_together_halve_the_power_at_the_cutoff(order, cutoff):
    sections = butterworth_sections(cutoff, order, RATE)
    response = sosfreqz(sections, [cutoff], fs=RATE)[1]
    assert np.abs(response[0]) ** 4 == pytest.approx(0.5, rel=1e-6)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"kind": "savitzky-golay", "window": 30}, "window is 30; expected an odd number"),
        ({"kind": "savitzky-golay", "window": 5, "order": 5}, "order is 5; expected less than the window of 5"),
        ({"kind": "savitzky-golay", "window": 7, "cutoff": 20.0}, "give only one of them"),
        ({"kind": "butterworth"}, "needs a cutoff"),
        ({"kind": "butterworth", "cutoff": 300.0}, "cutoff is 300 Hz; expected below half of the log's 500 Hz"),
        ({"kind": "butterworth", "cutoff": 30.0, "window": 9}, "window is 9, which the filter of kind 'butterworth'"),
        ({"kind": "log", "cutoff": 30.0}, "set kind to 'savitzky-golay' or 'butterworth'"),
        ({"kind": "auto"}, "must be chosen from a log"),
    ],
)
def test_settings_that_do_not_go_together_are_refused(values, sentence):
    with pytest.raises(SettingsError) as caught:
        make_filter(FilterSettings(**values), PERIOD)
    assert sentence in str(caught.value)
    assert "[identify.filter]" in str(caught.value)


def test_the_logs_own_derivatives_need_no_edges():
    motion_filter = make_filter(FilterSettings(kind="log"), PERIOD)
    assert motion_filter.half_width == 0
    np.testing.assert_array_equal(motion_filter.smooth(walk()), walk())
    with pytest.raises(SettingsError, match="from the log"):
        motion_filter.apply(walk())


class TestChosenCutoff:
    rate = 1000.0

    def motion(self, frequencies, samples=20_000, joints=2):
        """Make position and acceleration as sums of sines of equal acceleration, shape (T, joints)."""
        time = np.arange(samples) / self.rate
        rng = np.random.default_rng(3)
        acceleration, position = np.zeros((2, samples, joints))
        for frequency in frequencies:
            wave = np.sin(2 * np.pi * frequency * time[:, None] + rng.uniform(0, 6, joints))
            acceleration += 10 * wave
            position -= 10 * wave / (2 * np.pi * frequency) ** 2
        return position, acceleration

    def noise(self, size, samples=20_000, joints=2, seed=4):
        return size * np.random.default_rng(seed).standard_normal((samples, joints))

    def test_more_encoder_noise_means_a_longer_window(self):
        position, acceleration = self.motion([0.5, 3.0])
        windows = [
            choose_cutoff([acceleration], self.rate, [position + self.noise(size)]).window
            for size in (0.0, 1e-8, 1e-6, 1e-4)
        ]
        assert windows == sorted(windows)
        assert windows[0] == 9
        assert windows[-1] > 40

    @pytest.mark.parametrize("stiffness", [1e3, 1e5])
    def test_a_controller_response_to_encoder_noise_is_no_motion(self, stiffness):
        """Torque and position are coherent at all frequencies; only the spectrum shows where motion ends."""
        position, acceleration = self.motion([0.5, 3.0])
        noise = self.noise(1e-5)
        choice = choose_cutoff([acceleration - stiffness * noise], self.rate, [position + noise])
        assert 3.6 < choice.cutoff < 25.0

    def test_the_choice_keeps_the_motion(self):
        """The chosen filter loses less than 0.1 % of the acceleration's power."""
        position, acceleration = self.motion([1.0, 8.0])
        choice = choose_cutoff([acceleration], self.rate, [position + self.noise(1e-5)])
        motion_filter = make_filter(resolve_auto(FilterSettings(), choice), 1 / self.rate)
        h = motion_filter.half_width
        assert 2 * h + 1 == choice.window
        assert f"cutoff {choice.cutoff:.3g} Hz, a window of {choice.window} samples" in choice.reason
        lost = motion_filter.apply(position)[2] - acceleration[h:-h]
        assert np.mean(lost**2) < 1e-3 * np.mean(acceleration**2)

    @pytest.mark.parametrize("seed", range(4))
    def test_legs_that_swing_in_turn_are_averaged_over_many_parts(self, seed):
        """Each of two joints has data in two short segments of four, as in a walk of five steps."""
        position, acceleration = self.motion([2.0, 9.0])
        position = position + self.noise(1e-5, seed=seed)
        acceleration = acceleration + self.noise(5.0, seed=seed + 10)
        whole = choose_cutoff([acceleration], self.rate, [position])
        rows = [slice(700 * k, 700 * k + 650) for k in range(4)]
        there = [np.where(np.arange(2) == k % 2, acceleration[run], np.nan) for k, run in enumerate(rows)]
        places = [position[run] + k for k, run in enumerate(rows)]
        assert average_spectra(there, places, self.rate).parts.min() >= 8
        assert 0.7 < choose_cutoff(there, self.rate, places).cutoff / whole.cutoff < 3.0
