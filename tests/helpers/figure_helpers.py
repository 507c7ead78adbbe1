"""What a figure draws, as numbers."""

import numpy as np


def drawn_numbers(figure):
    """Return where every line of a figure has its points, and how large its bars are."""
    found = []
    for axes in figure.axes:
        for line in axes.lines:
            found += [*np.ravel(line.get_xdata()), *np.ravel(line.get_ydata())]
        found += [size for bar in axes.patches for size in (bar.get_width(), bar.get_height())]
    return np.array(found, dtype=float)


def shows(figure, values):
    """Return whether a figure draws every one of some values."""
    numbers = drawn_numbers(figure)
    return all(np.isclose(numbers, value, rtol=1e-6, atol=1e-9).any() for value in np.ravel(values))
