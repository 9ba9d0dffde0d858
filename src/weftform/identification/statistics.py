"""How well the curves determine the parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from weftform.fabric.laws import Floats
from weftform.identification.fits import Parameter
from weftform.laboratory.scatter import neighbour_correlation, student

CONFIDENCE = 0.95
HIGH_CORRELATION = 0.95
HIGH_CONDITION = 30.0
"""Condition number of the scaled Jacobian beyond which parameters stand for one another (Belsley, Kuh and Welsch,
Regression Diagnostics, 1980, ch. 3)."""
INSENSITIVE = 1.0e-3
"""A parameter that moves the curves by a smaller share than this of its own relative change is not seen in them."""
NEAR_BOUND = 1.0e-3
"""Share of the way between its bounds at which a parameter counts as at its bound."""
SYSTEMATIC = 0.9
SMALL_MISFIT = 2.0e-3
"""Neighbouring residuals correlated by more than the first, with a misfit above the second: the model is at fault."""


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """What the Jacobian at the solution says.

    Attributes
    ----------
    standard_errors
        Of the parameters in their own coordinates, shape [p]; infinite where nothing determines one, NaN at a bound.
    lower, upper
        95 % interval of the values, shape [p]; NaN at a bound.
    correlation
        Shape [p, p]; NaN for a parameter at a bound or one that nothing determines.
    covariance
        Of the coordinates, shape [p, p]; zero for a parameter at a bound.
    condition
        Condition number of the Jacobian with columns of unit length.
    quantile
        Of Student's t, that the interval was made with.
    freedom
        Degrees of freedom: independent residuals less parameters.
    residual_correlation
        Between neighbouring residuals, of the curve where it is largest.
    sensitivity
        Relative change of the curves (root mean square) per relative change of each parameter, shape [p].
    warnings
        What the user should know before trusting the values.
    """

    standard_errors: Floats
    lower: Floats
    upper: Floats
    correlation: Floats
    covariance: Floats
    condition: float
    quantile: float
    freedom: float
    residual_correlation: float
    sensitivity: Floats
    warnings: tuple[str, ...]


def uncertainty(
    jacobian: Floats,
    residuals: Sequence[Floats],
    weights: Sequence[float],
    parameters: Sequence[Parameter],
    values: Sequence[float],
) -> Uncertainty:
    """Confidence intervals, correlations and warnings from the linear model at the solution.

    Weighted least squares (Seber and Wild, Nonlinear Regression, 1989, ch. 5) with a variance ``s^2`` for each curve:
    the covariance is ``(J'J)^-1 (sum_k s_k^2 J_k' J_k) (J'J)^-1``, which for one curve is ``s^2 (J'J)^-1``.
    Neighbouring residuals of a measured curve err alike, so n of them count as ``n (1 - r) / (1 + r)`` independent
    ones, with ``r`` the correlation of neighbours (first-order autoregressive errors: Bayley and Hammersley 1946); but
    not for fewer than half the runs of one sign, which a model that cannot follow its curve still leaves. Intervals
    are rough then, and a warning says so.

    Parameters
    ----------
    jacobian
        Derivative of all residuals by the coordinates of the parameters, shape [N, p].
    residuals
        Weighted residuals of each curve, in the order of the rows of the Jacobian.
    weights
        Of the curves.
    parameters, values
        In the order of the columns.
    """
    size = jacobian.shape[1]
    names = [p.name for p in parameters]
    at_bound = np.array([_at_bound(p, v) for p, v in zip(parameters, values, strict=True)])
    free = ~at_bound
    neighbours = [neighbour_correlation(r) for r in residuals]
    independent = np.array(
        [max(len(r) * (1.0 - c) / (1.0 + c), 0.5 * _runs(r)) for r, c in zip(residuals, neighbours, strict=True)]
    )
    freedom = max(float(independent.sum()) - int(free.sum()), 1.0)
    variances = [float(r @ r) / (n * freedom / independent.sum()) for r, n in zip(residuals, independent, strict=True)]
    misfit = float(np.sqrt(sum(float(r @ r) for r in residuals) / sum(weights)))
    length = np.linalg.norm(jacobian, axis=0)
    relative = np.array([abs(v) / p.slope(v) if v else 1.0 for p, v in zip(parameters, values, strict=True)])
    sensitivity = length * relative / np.sqrt(sum(weights))
    warnings = [
        f"{name} ends at its bound {values[k]:.4g}: widen the bounds, or the curves do not determine it"
        for k, name in enumerate(names)
        if at_bound[k]
    ]
    unseen = free & (sensitivity < INSENSITIVE)
    warnings += [
        f"{name} is not seen in the curves: a change of 10 % moves them by {10 * sensitivity[k]:.2g} %"
        for k, name in enumerate(names)
        if unseen[k]
    ]
    errors = np.full(size, np.nan)
    errors[unseen] = np.inf
    correlation = np.full((size, size), np.nan)
    covariance = np.zeros((size, size))
    seen = np.flatnonzero(free & ~unseen)
    condition = np.inf if unseen.any() else 1.0
    if seen.size:
        scaled = jacobian[:, seen] / length[seen]
        singular = np.linalg.svd(scaled, compute_uv=False)
        small = float(singular[-1]) < 1e-10 * float(singular[0])
        condition = max(condition, np.inf if small else float(singular[0] / singular[-1]))
        if small:
            errors[seen] = np.inf
            warnings.append("some parameters cannot be told apart at all: " + ", ".join(names[k] for k in seen))
        else:
            inverse = np.linalg.inv(scaled.T @ scaled)
            ends = np.cumsum([len(r) for r in residuals])[:-1]
            middle = sum(v * j.T @ j for v, j in zip(variances, np.split(scaled, ends), strict=True))
            part = inverse @ middle @ inverse / np.outer(length[seen], length[seen])
            covariance[np.ix_(seen, seen)] = part
            errors[seen] = np.sqrt(np.diag(part))
            # of the estimates for equal errors, so that it is known for an exact fit too
            root = np.sqrt(np.diag(inverse))
            correlation[np.ix_(seen, seen)] = inverse / np.outer(root, root)
    if HIGH_CONDITION < condition < np.inf:
        warnings.append(
            f"the parameters are poorly told apart: condition number {condition:.3g} (beyond {HIGH_CONDITION:g} they stand "
            "for one another); fit fewer, or add a curve"
        )
    for a in range(size):
        for b in range(a):
            if abs(correlation[a, b]) > HIGH_CORRELATION:
                warnings.append(f"{names[b]} and {names[a]} are correlated by {correlation[a, b]:.3f}")
    if max(neighbours) > SYSTEMATIC and misfit > SMALL_MISFIT:
        warnings.append(
            f"the errors are systematic (neighbours correlated by {max(neighbours):.3f}): the model does not follow the "
            "curves, and the intervals are rough"
        )
    quantile = student(CONFIDENCE, freedom)
    lower, upper = _interval(parameters, values, quantile * errors)
    for k, name in enumerate(names):
        if np.isfinite(errors[k]) and abs(values[k]) > 0.0 and upper[k] - lower[k] > 2.0 * abs(values[k]):
            warnings.append(f"{name} is hardly determined: 95 % interval {lower[k]:.3g} to {upper[k]:.3g}")
    return Uncertainty(
        errors,
        lower,
        upper,
        correlation,
        covariance,
        float(condition),
        quantile,
        float(freedom),
        max(neighbours),
        sensitivity,
        tuple(warnings),
    )


def _at_bound(parameter: Parameter, value: float) -> bool:
    low, here, high = (parameter.normalised(v) for v in (parameter.lower, value, parameter.upper))
    return min(here - low, high - here) < NEAR_BOUND * (high - low)


def _runs(residuals: Floats) -> int:
    """How many stretches of one sign there are."""
    signs = residuals > 0.0
    return 1 + int((signs[1:] != signs[:-1]).sum())


def _interval(parameters: Sequence[Parameter], values: Sequence[float], half: Floats) -> tuple[Floats, Floats]:
    lower, upper = np.empty(len(values)), np.empty(len(values))
    for k, (parameter, value) in enumerate(zip(parameters, values, strict=True)):
        if parameter.logarithmic:
            with np.errstate(over="ignore"):
                lower[k], upper[k] = value * np.exp(-half[k]), value * np.exp(half[k])
        else:
            lower[k], upper[k] = value - parameter.size * half[k], value + parameter.size * half[k]
    return lower, upper
