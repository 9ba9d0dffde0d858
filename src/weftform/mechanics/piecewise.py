"""A material law as the time loop sees it: polynomial pieces of equal width, linear beyond the end.

Every law of ``weftform.fabric`` reduces to this form. A polynomial law is one piece and needs no look-up;
tabulated and logarithmic laws are many cubic pieces.
"""

from __future__ import annotations

from typing import Any

from weftform.mechanics.compiled import scalar


@scalar
def horner(coefficients: Any, degree: int, start: int, x: float) -> float:
    """Polynomial value; ``coefficients[start]`` is the highest power."""
    value: float = coefficients[start]
    for k in range(1, degree + 1):
        value = value * x + coefficients[start + k]
    return value


@scalar
def polynomial(coefficients: Any, x: float) -> float:
    """Polynomial value of two terms or more, highest power first. The loop over a tuple unrolls: its type has a length.

    Even and odd powers are summed side by side (Knuth, The Art of Computer Programming 2, Sec. 4.6.4: second-order
    Horner), which halves the chain of operations that wait for each other.
    """
    terms = len(coefficients)
    squared = x * x
    value: float = coefficients[0]
    other: float = coefficients[1]
    for k in range(2, terms - 1, 2):
        value = value * squared + coefficients[k]
        other = other * squared + coefficients[k + 1]
    if terms > 2 and terms % 2 == 1:
        last: float = coefficients[terms - 1]
        return value * squared + (other * x + last)
    return value * x + other


@scalar
def piecewise_value(coefficients: Any, degree: int, pieces: int, width: float, end_slope: float, x: float) -> float:
    """Value at ``x >= 0`` of a law with ``pieces`` polynomials of equal ``width``, linear beyond the last."""
    end = width * pieces
    inside = min(x, end)
    beyond = end_slope * max(x - end, 0.0)
    if pieces == 1:
        return polynomial(coefficients, inside) + beyond
    piece = min(int(inside / width), pieces - 1)
    return horner(coefficients, degree, piece * (degree + 1), inside - piece * width) + beyond


@scalar
def piecewise_slope(coefficients: Any, degree: int, pieces: int, width: float, end_slope: float, x: float) -> float:
    """Derivative of :func:`piecewise_value`."""
    end = width * pieces
    if x >= end:
        return end_slope
    piece = min(int(x / width), pieces - 1)
    start = piece * (degree + 1)
    local = x - piece * width
    value = 0.0
    for k in range(degree):
        value = value * local + (degree - k) * coefficients[start + k]
    return value


@scalar
def piecewise_integral(
    coefficients: Any, integrals: Any, degree: int, pieces: int, width: float, end_slope: float, x: float
) -> float:
    """Integral from 0 to ``x`` of :func:`piecewise_value`; ``integrals[p]`` is that up to piece ``p``."""
    end = width * pieces
    inside = min(x, end)
    piece = min(int(inside / width), pieces - 1)
    local = inside - piece * width
    start = piece * (degree + 1)
    value = 0.0
    for k in range(degree + 1):
        value = value * local + coefficients[start + k] / (degree + 1 - k)
    total: float = integrals[piece] + value * local
    if x > end:
        at_end = horner(coefficients, degree, (pieces - 1) * (degree + 1), width)
        total += (x - end) * (at_end + 0.5 * end_slope * (x - end))
    return total
