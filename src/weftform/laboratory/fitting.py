"""Least squares for a polynomial law: over all points of all specimens, monotone, with a band.

The unknowns are the coefficients of ``c1 x + c2 x^2 + ...``; the measured quantity is any linear function
of them, so the tensile force (Eq. 3) and the bias-extension force (Eq. 7) are fitted by the same lines of
code. Specimens, not points, are the independent repetitions of a test: neighbouring points of one curve
share its errors. The band therefore comes from how much the specimens differ from each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from weftform.errors import MeasurementError
from weftform.fabric.laws import Floats, PolynomialLaw
from weftform.laboratory.monotone import power_basis, rising_coefficients
from weftform.laboratory.scatter import neighbour_correlation, student

Weighting = Literal["uniform", "relative"]
SIMULATIONS = 4000
"""Draws that give the critical value of a simultaneous band (its own error is then about 2 %)."""
RELATIVE_FLOOR = 0.02
"""Relative weighting counts every value as at least this share of the largest, or the first points would
rule."""


@dataclass(frozen=True)
class Band:
    """A band around a fitted curve: arrays of one shape, ``lower <= centre <= upper``.

    ``critical`` is the number of standard errors to either side.
    """

    lower: Floats
    centre: Floats
    upper: Floats
    critical: float


@dataclass(frozen=True, eq=False)
class PolynomialFit:
    """A polynomial fitted to the curves of one or more specimens.

    Attributes
    ----------
    powers
        Exponent of each coefficient, shape [p]: 1..degree, with 0 in front where the origin is not imposed.
    coefficients
        Shape [p], monotone where that was asked for.
    free_coefficients
        Shape [p], without the monotone constraint; the same where it does not act.
    covariance
        Of ``free_coefficients``, shape [p, p].
    deviations
        Of the coefficients of each specimen from the mean, shape [specimens, p]; empty for one specimen.
    within
        Covariance that the noise about the curve of each specimen gives by itself, shape [p, p]: the true
        covariance is no smaller, whatever few specimens say.
    shared
        Errors of the coefficients that all specimens share, drawn at random, shape [draws, p]; part of
        ``covariance``.
    valid_to
        End of the validity, in the variable of the polynomial.
    specimens, points
        How many were used.
    rms
        Root mean square of the residuals of all points [unit of the response].
    r_squared
        1 - residual / total sum of squares.
    constrained
        Whether the monotone constraint acts.
    freedom
        Degrees of freedom of the covariance.
    """

    powers: tuple[int, ...]
    coefficients: Floats
    free_coefficients: Floats
    covariance: Floats
    deviations: Floats
    within: Floats
    shared: Floats
    valid_to: float
    specimens: int
    points: int
    rms: float
    r_squared: float
    constrained: bool
    freedom: int
    _critical: dict[tuple[object, ...], float] = field(default_factory=dict, repr=False)

    @property
    def standard_errors(self) -> Floats:
        """Of the coefficients, shape [p]."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def constant(self) -> float:
        """Value at zero; 0 where the origin is imposed."""
        return float(self.coefficients[0]) if self.powers[0] == 0 else 0.0

    @property
    def law_coefficients(self) -> tuple[float, ...]:
        """Coefficients of x, x^2, ..."""
        return tuple(float(c) for c, k in zip(self.coefficients, self.powers, strict=True) if k > 0)

    def law(self) -> PolynomialLaw:
        """The fit as a law of :mod:`weftform.fabric`."""
        return PolynomialLaw(self.law_coefficients, self.valid_to, self.constant)

    def basis(self, x: Floats, kind: Literal["value", "slope"] = "value") -> Floats:
        """Values or slopes of the powers at ``x``, shape [len(x), p]."""
        return power_basis(np.asarray(x, float), self.powers, kind)

    def band(
        self,
        x: Floats,
        *,
        kind: Literal["value", "slope"] = "value",
        level: float = 0.95,
        simultaneous: bool = True,
    ) -> Band:
        """Confidence band of the curve or of its slope at ``x`` (shape [m]).

        A simultaneous band holds the whole true curve over ``x`` with the stated probability; a pointwise one
        holds it at any one place, and is narrower. The critical value is the quantile of ``max |mean| /
        standard error`` over simulated sets of as many specimens with the covariance found (one specimen:
        of a multivariate t); seeded, so always the same. The band is widened, never narrowed, to hold the
        monotone fit where the constraint acts.

        Raises
        ------
        ValueError
            ``level`` is not between 0 and 1.
        """
        if not 0.0 < level < 1.0:
            raise ValueError(f"level must lie between 0 and 1, got {level}")
        x = np.atleast_1d(np.asarray(x, float))
        basis = self.basis(x, kind)
        free = basis @ self.free_coefficients
        common = self.shared @ basis.T / np.sqrt(max(len(self.shared), 1))
        scatter, noise = (
            np.einsum("ij,jk,ik->i", basis, c, basis)
            for c in (self.covariance - self.shared.T @ self.shared / max(len(self.shared), 1), self.within)
        )
        error = np.sqrt(np.maximum(np.maximum(scatter, noise), 0.0) + (common**2).sum(axis=0))
        key = (kind, level, simultaneous, x.tobytes())
        if key not in self._critical:
            self._critical[key] = self._simultaneous(basis, level) if simultaneous else student(level, self.freedom)
        critical = self._critical[key]
        centre = basis @ self.coefficients
        return Band(
            np.minimum(free - critical * error, centre),
            centre,
            np.maximum(free + critical * error, centre),
            critical,
        )

    def _simultaneous(self, basis: Floats, level: float) -> float:
        rng = np.random.default_rng(0)
        if self.specimens > 1:
            n = self.specimens
            # Roots of the covariance of one specimen: between specimens (few, so of low rank) and noise (of
            # full rank). Together they are rather too large than too small, so the band errs on the safe
            # side.
            scale, turn = np.linalg.eigh(n * self.within)
            between = self.deviations @ basis.T / np.sqrt(n - 1)
            noise = (turn * np.sqrt(np.maximum(scale, 0.0))).T @ basis.T
            floor = (noise**2).sum(axis=0)
            size = np.maximum((between**2).sum(axis=0), floor)
            used = size > 1e-24 * max(float(size.max()), 1e-300)
            if not used.any():
                return student(level, self.freedom)
            curves = np.vstack([between, noise])[:, used]
            draws = rng.standard_normal((SIMULATIONS, n, len(curves))) @ curves
            error, variance = draws.mean(axis=1), draws.var(axis=1, ddof=1) / n
            if len(self.shared):
                common = self.shared @ basis.T[:, used] / np.sqrt(len(self.shared))
                error = error + rng.standard_normal((SIMULATIONS, len(common))) @ common
                variance = variance + (common**2).sum(axis=0)
            ratio = np.abs(error) / np.sqrt(variance)
        else:
            scale, turn = np.linalg.eigh(self.covariance)
            root = turn * np.sqrt(np.maximum(scale, 0.0))
            curves = basis @ root
            length = np.linalg.norm(curves, axis=1)
            curves = curves[length > 0.0] / length[length > 0.0, None]
            if not curves.size:
                return student(level, self.freedom)
            chi = np.sqrt(rng.chisquare(self.freedom, SIMULATIONS) / self.freedom)
            ratio = np.abs(rng.standard_normal((SIMULATIONS, len(root))) @ curves.T) / chi[:, None]
        return float(np.quantile(ratio.max(axis=1), level))


def fit_polynomial(
    designs: Sequence[Floats],
    responses: Sequence[Floats],
    powers: Sequence[int],
    valid_to: float,
    *,
    monotone: bool = True,
    weighting: Weighting = "uniform",
    designs_again: Sequence[Sequence[Floats]] = (),
) -> PolynomialFit:
    """Fit the coefficients over all points, each specimen with the same weight.

    Parameters
    ----------
    designs
        Per specimen, the linear map from the coefficients to its measured values, shape [points, p].
    responses
        Per specimen, its measured values, shape [points].
    powers
        Exponents of the polynomial, shape [p].
    valid_to
        End of the interval on which the polynomial must rise.
    monotone
        Impose a rising polynomial on ``[0, valid_to]``.
    weighting
        ``uniform`` (errors of one size along the curve) or ``relative`` (errors in proportion to the value).
    designs_again
        ``designs`` as they might have been, where they come from a measurement that all specimens share
        (the angle). The scatter of the coefficients over them is added to the covariance.

    Raises
    ------
    MeasurementError
        Fewer points than coefficients, or points that do not tell the coefficients apart.

    Notes
    -----
    The covariance of the mean over ``n`` specimens is that of their scores (the cluster-robust or sandwich
    estimate), which for specimens sampled alike is the covariance of the separately fitted coefficients
    divided by ``n``. A single specimen has no such scatter: the covariance then comes from the residuals,
    corrected for their correlation along the curve.
    """
    p, n = len(powers), len(designs)
    points = sum(len(r) for r in responses)
    if points < p + 2 or min(len(r) for r in responses) < 2:
        raise MeasurementError(
            f"too few points for a polynomial with {p} coefficients",
            expected=f"{p + 2} points at least in the interval",
            got=f"{points}",
            hint="lower the degree, or widen the interval",
        )
    scale = float(valid_to) ** np.asarray(powers, float)
    largest = max(float(np.abs(r).max()) for r in responses) or 1.0
    weights = [np.full(len(r), 1.0 / np.sqrt(len(r))) for r in responses]
    rows, values = _weighted(designs, responses, weights, scale)
    if np.linalg.matrix_rank(np.vstack(rows)) < p:
        raise MeasurementError(
            f"the points do not determine {p} coefficients",
            expected="points spread over the whole interval",
            hint="lower the degree, or widen the interval",
        )
    free = np.linalg.lstsq(np.vstack(rows), np.concatenate(values), rcond=None)[0]
    if weighting == "relative":
        # Weights from the first fit, not from the noisy values: those would favour every point that errs
        # downwards.
        sizes = [np.maximum(np.abs(d @ (free / scale)) / largest, RELATIVE_FLOOR) for d in designs]
        weights = [w / size for w, size in zip(weights, sizes, strict=True)]
        rows, values = _weighted(designs, responses, weights, scale)
        free = np.linalg.lstsq(np.vstack(rows), np.concatenate(values), rcond=None)[0]
    a, y = np.vstack(rows), np.concatenate(values)
    bread: Floats = np.asarray(np.linalg.inv(a.T @ a), float)
    if n > 1:
        deviations = np.array([n * bread @ r.T @ (v - r @ free) for r, v in zip(rows, values, strict=True)])
        covariance = deviations.T @ deviations / (n * (n - 1))
        within = _noise(rows, values, free, deviations, bread)
        freedom = n - 1
    else:
        residual = y - a @ free
        freedom = points - p
        covariance = bread * float(residual @ residual) / freedom * _inflation(residual)
        deviations, within = np.empty((0, p)), covariance
    shared = np.empty((len(designs_again), p))
    for k, again in enumerate(designs_again):
        rows_again, _ = _weighted(again, responses, weights, scale)
        shared[k] = np.linalg.lstsq(np.vstack(rows_again), y, rcond=None)[0] - free
    if len(shared):
        covariance = covariance + shared.T @ shared / len(shared)
    best = rising_coefficients(a, y, free, powers) if monotone else free
    constrained = best is not free
    fitted = [d @ (best / scale) for d in designs]
    residuals = np.concatenate([r - f for r, f in zip(responses, fitted, strict=True)])
    everything = np.concatenate(list(responses))
    spread = float(((everything - everything.mean()) ** 2).sum())
    return PolynomialFit(
        powers=tuple(powers),
        coefficients=best / scale,
        free_coefficients=free / scale,
        covariance=covariance / np.outer(scale, scale),
        deviations=deviations / scale,
        within=within / np.outer(scale, scale),
        shared=shared / scale,
        valid_to=float(valid_to),
        specimens=n,
        points=points,
        rms=float(np.sqrt(np.mean(residuals**2))),
        r_squared=1.0 - float(residuals @ residuals) / spread if spread > 0.0 else 0.0,
        constrained=constrained,
        freedom=freedom,
    )


def _weighted(
    designs: Sequence[Floats], responses: Sequence[Floats], weights: Sequence[Floats], scale: Floats
) -> tuple[list[Floats], list[Floats]]:
    """Rows and values of the least-squares problem, per specimen, for scaled coefficients."""
    rows = [d / scale * w[:, None] for d, w in zip(designs, weights, strict=True)]
    return rows, [r * w for r, w in zip(responses, weights, strict=True)]


def _noise(rows: list[Floats], values: list[Floats], free: Floats, deviations: Floats, bread: Floats) -> Floats:
    """Covariance of the mean from the residuals about each specimen's own curve, of any size along it."""
    p = len(free)
    middle = np.zeros((p, p))
    for row, value, own in zip(rows, values, deviations, strict=True):
        rest = value - row @ (free + own)
        score = row * rest[:, None]
        middle += score.T @ score * len(rest) / max(len(rest) - p, 1) * _inflation(rest)
    return np.asarray(bread @ middle @ bread)


def _inflation(residual: Floats) -> float:
    """Variance inflation of residuals with lag-one correlation r: (1 + r) / (1 - r), never below 1."""
    r = neighbour_correlation(residual)
    return (1.0 + r) / (1.0 - r)
