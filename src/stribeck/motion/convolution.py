"""Finite impulse responses run over many signals at once, fast and without loss of digits."""

import numpy as np
from scipy.linalg import convolution_matrix

from stribeck.typing import Array

MIN_BLOCK = 64
"""Fewest output samples a block; shorter blocks pay more for the call than for the arithmetic."""


def correlate_valid(signal: Array, kernels: Array, orders: tuple[int, ...]) -> tuple[Array, ...]:
    """Slide kernels over a signal, keeping only where they lie inside it: `y[t] = sum_m k[m] x[t + m]`.

    This is (7.8) with the impulse response reversed. A block of outputs is one product of a banded matrix, which holds
    all kernels, with the block of inputs: the same sums as a convolution, at the speed of matrix multiplication.
    A block's middle row is subtracted first, because a derivative of nearly equal numbers loses digits.

    Parameters
    ----------
    signal
        Shape (T, n), without NaN.
    kernels
        One row a kernel, shape (k, L), the step in time already in them.
    orders
        Which derivative each kernel gives: the taps sum to 1 for order 0 and to 0 for the others.

    Returns
    -------
    tuple of Array
        One a kernel, shape (T - L + 1, n); empty where the signal is shorter than the kernel.
    """
    count, length = kernels.shape
    samples = max(len(signal) - length + 1, 0)
    outputs = tuple(np.empty((samples, signal.shape[1])) for _ in range(count))
    block = max(MIN_BLOCK, length // 3)
    inputs = min(block, samples) + length - 1
    band = np.stack([convolution_matrix(kernel[::-1], inputs, "valid") for kernel in kernels]) if samples else kernels
    for start in range(0, samples, block):
        rows = min(block, samples - start)
        window = signal[start : start + rows + length - 1]
        middle = window[len(window) // 2]
        product = band[:, :rows, : len(window)] @ (window - middle)
        for output, order, result in zip(outputs, orders, product, strict=True):
            output[start : start + rows] = result + middle if order == 0 else result
    return outputs
