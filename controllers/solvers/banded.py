"""Cholesky factor of a symmetric matrix with a band: `A = L Lᵀ`.

Storage: `band[j, i - j] = A[i, j]` for `j ≤ i < j + w`, (m, w); what would lie beyond the last row is 0.
Cost: `m w²` for the factor, `2 m w` for a solution.
"""

from handrail.controllers.numerics.jit import jit


@jit
def factor(band):
    """Replace A by L; return whether A is positive definite."""
    size, width = band.shape
    for j in range(size):
        if not band[j, 0] > 0.0:
            return False
        scale = 1.0 / band[j, 0] ** 0.5
        for t in range(width):
            band[j, t] *= scale
        for c in range(1, min(width, size - j)):
            share = band[j, c]
            for t in range(c, width):
                band[j + c, t - c] -= share * band[j, t]
    return True


@jit
def forward(band, x, start):
    """Replace x by `L⁻¹ x`; its entries before `start` are 0, and those beyond the matrix are left alone."""
    size, width = band.shape
    for j in range(start, size):
        value = x[j] / band[j, 0]
        x[j] = value
        for t in range(1, min(width, size - j)):
            x[j + t] -= band[j, t] * value


@jit
def backward(band, x):
    """Replace x by `L⁻ᵀ x`."""
    size, width = band.shape
    for j in range(size - 1, -1, -1):
        total = x[j]
        for t in range(1, min(width, size - j)):
            total -= band[j, t] * x[j + t]
        x[j] = total / band[j, 0]
