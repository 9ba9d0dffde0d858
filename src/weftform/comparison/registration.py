"""Laying a measured shape over the simulated one: the turn, shift and scale that fit best.

Outlines have no points in common, so the distance from each curve to the other is made small, in both directions: with
one direction alone a free scale would shrink the curve away. The distance to a curve is not convex in the turn, so the
fit starts from every promising turn. A robust loss then keeps a frayed edge or a missing corner from pulling the rest
(least squares over the normal distance after P. J. Besl and N. D. McKay, IEEE PAMI 14 (1992) 239-256, and Y. Chen and
G. Medioni, Image Vision Comput. 10 (1992) 145-155).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from weftform.comparison.outline import Pieces, Ring
from weftform.comparison.placement import Placement, wrapped

Floats = NDArray[np.float64]

PIECES = 400
"""Pieces of each outline that take part."""
FIRST_PIECES = 120
"""Pieces while the turns are ranked."""
SWEEP_DEG = 2.0
"""Step of the turns that are tried."""
STARTS = 6
"""Turns from which the fit starts."""
AS_GOOD = 1.02
"""Ratio of misfits up to which two turns count as equally good: shapes are symmetric within their scatter."""
FINEST = 1e-9
"""Misfit, in parts of the outline's size, below which nothing is told apart."""
ROUND = 0.01
"""An outline is round where turning it changes the misfit by less than this part of its size."""
OUTLYING = 3.0
"""Distances beyond so many times the scatter of the better half count less than by their square."""
ROBUST_PASSES = 20


def register_outline(measured: Ring, simulated: Ring, *, scale: bool = False) -> Placement:
    """Placement of the measured outline that lays it over the simulated one.

    Among turns that fit equally well, as those of a square do, the smallest is taken and the others are named. A round
    outline is not turned.

    Parameters
    ----------
    scale
        Find a scale as well.
    """
    fit = _OutlineFit(measured, simulated, scale, FIRST_PIECES)
    turns, misfits = fit.sweep()
    fit.turns = bool(np.ptp(misfits) >= ROUND * simulated.size)
    if not fit.turns:
        starts = np.zeros(1)
    else:
        valleys = (misfits <= np.roll(misfits, 1)) & (misfits <= np.roll(misfits, -1))
        starts = turns[valleys][np.argsort(misfits[valleys])[:STARTS]]
        starts = np.append(starts, 0.0)
    found = [fit.least_squares(start) for start in starts]
    misfit = np.array([fit.rms(p) for p in found])
    good = misfit <= AS_GOOD * misfit.min() + FINEST * simulated.size
    angles = [wrapped(float(np.degrees(p[0]))) for p in found]
    ranked = sorted((k for k in range(len(found)) if good[k]), key=lambda k: (round(abs(angles[k]), 3), misfit[k]))
    others: list[float] = []
    for k in ranked[1:]:
        if all(abs(wrapped(angles[k] - known)) > 1.0 for known in (angles[ranked[0]], *others)):
            others.append(angles[k])
    fine = _OutlineFit(measured, simulated, scale, PIECES)
    fine.turns = fit.turns
    return fine.placement(fine.robust(found[ranked[0]]), tuple(others))


def register_markers(measured: Floats, simulated: Floats, *, scale: bool = False) -> Placement:
    """Placement that brings measured markers nearest to their simulated places, by least squares in plan view.

    Parameters
    ----------
    measured, simulated
        Positions of the same markers [mm], two at least, shape [n, 2] or [n, 3]; heights are shifted by their mean.
    scale
        Find a scale as well.
    """
    m, s = (p[:, 0] + 1j * p[:, 1] for p in (measured, simulated))
    m0, s0 = m.mean(), s.mean()
    product, square = np.vdot(m - m0, s - s0), float((np.abs(m - m0) ** 2).sum())
    size = float(abs(product)) / square if scale else 1.0
    turn = product / abs(product) if abs(product) > 0.0 else 1.0 + 0.0j
    shift = s0 - size * turn * m0
    deep = measured.shape[1] == 3 and simulated.shape[1] == 3
    lift = float(simulated[:, 2].mean() - size * measured[:, 2].mean()) if deep else 0.0
    placed = Placement(float(np.degrees(np.angle(turn))), (float(shift.real), float(shift.imag), lift), size, "markers")
    axes = 3 if deep else 2
    left = np.linalg.norm(placed.apply(measured)[:, :axes] - simulated[:, :axes], axis=1)
    return Placement(placed.turn_deg, placed.shift_mm, size, "markers", float(np.sqrt((left**2).mean())))


class _OutlineFit:
    """Distances between two outlines as functions of (turn [rad], shift x, shift y [mm], log of the scale).

    The turn is about the middle of the measured outline, and the shift is that of the middle.
    """

    def __init__(self, measured: Ring, simulated: Ring, scale: bool, count: int) -> None:
        self.measured, self.simulated, self.scale = _thinned(measured), _thinned(simulated), scale
        self.own, self.target = self.measured.pieces(count), self.simulated.pieces(count)
        self.pivot, self.goal = self.measured.centre, self.simulated.centre
        self.weights = 0.5 * np.concatenate([_shares(self.own), _shares(self.target)])
        self.first_size = self.simulated.size / self.measured.size if scale else 1.0
        self.turns = True
        self._last: tuple[Floats, Floats, Floats] | None = None

    def sweep(self) -> tuple[Floats, Floats]:
        """Misfit [mm] at turns [rad] all around with the middles over each other; quick, from points alone."""
        from scipy.spatial import cKDTree

        own = self.first_size * (self.own.middles - self.pivot)
        target = self.target.middles - self.goal
        trees = cKDTree(target), cKDTree(own)
        turns = np.radians(np.arange(0.0, 360.0, SWEEP_DEG))
        misfits = []
        for turn in turns:
            r = _rotation(turn)
            squares = np.concatenate([trees[0].query(own @ r.T)[0], trees[1].query(target @ r)[0]]) ** 2
            misfits.append(np.sqrt((self.weights * squares).sum()))
        return turns, np.array(misfits)

    def start(self, turn: float) -> Floats:
        values = [turn, 0.0, 0.0]
        return np.array([*values, np.log(self.first_size)] if self.scale else values)

    def distances(self, p: Floats) -> tuple[Floats, Floats]:
        """Signed distances [mm] of the pieces of both outlines from the other, and their derivatives, shape [n, 3 or 4]."""
        if self._last is not None and np.array_equal(self._last[0], p):
            return self._last[1], self._last[2]
        size = float(np.exp(p[3])) if self.scale else 1.0
        turn = size * _rotation(p[0])
        shift = self.goal + p[1:3]
        # the measured curve as it lies now, from the simulated one
        arms = (self.own.middles - self.pivot) @ turn.T
        feet, normals = self.simulated.segments.feet(arms + shift)
        forth, out = _away(arms + shift - feet, normals)
        # the simulated curve, from the measured one: the feet are found in the measured axes
        feet, normals = self.measured.segments.feet((self.target.middles - shift) @ turn / size**2 + self.pivot)
        levers = (feet - self.pivot) @ turn.T
        back, away = _away(levers + shift - self.target.middles, normals @ turn.T / size)
        values, directions = np.concatenate([forth, back]), np.concatenate([out, away])
        levers = np.concatenate([arms, levers])
        # a foot slides along its curve, across the direction of the distance, so it counts as fixed
        across = np.stack([-levers[:, 1], levers[:, 0]], axis=1)
        slopes = [(directions * across).sum(axis=1) * self.turns, directions[:, 0], directions[:, 1]]
        if self.scale:
            slopes.append((directions * levers).sum(axis=1))
        self._last = p.copy(), values, np.stack(slopes, axis=1)
        return values, self._last[2]

    def rms(self, p: Floats) -> float:
        return float(np.sqrt((self.weights * self.distances(p)[0] ** 2).sum()))

    def least_squares(self, turn: float) -> Floats:
        weights = self.weights

        def loss(z: Floats) -> Floats:
            return np.stack([weights * z, weights, np.zeros_like(z)])

        return self._solve(self.start(turn), loss, 1.0, 1e-9)

    def robust(self, p: Floats) -> Floats:
        """Refine with a loss that grows linearly for outlying pieces.

        1.4826 medians are the standard deviation of a normal scatter.
        """
        weights, floor = self.weights, 1e-5 * self.simulated.size

        def loss(z: Floats) -> Floats:
            root = np.sqrt(1.0 + z)
            return np.stack([2.0 * weights * (root - 1.0), weights / root, -0.5 * weights / root**3])

        def scatter(p: Floats) -> float:
            return 1.4826 * _weighted_median(np.abs(self.distances(p)[0]), weights)

        # narrow first, until outlying pieces no longer widen the scatter of the others; then as wide as good pieces need
        width = np.inf
        for _ in range(ROBUST_PASSES):
            spread = max(scatter(p), floor)
            if spread > 0.98 * width:
                break
            width = spread
            p = self._solve(p, loss, width, 1e-10)
        return self._solve(p, loss, max(OUTLYING * scatter(p), floor), 1e-14)

    def _solve(self, start: Floats, loss: Any, width: float, finest: float) -> Floats:
        from scipy.optimize import least_squares

        found = least_squares(
            lambda p: self.distances(p)[0],
            start,
            lambda p: self.distances(p)[1],
            x_scale=np.array([1.0 / self.simulated.size, 1.0, 1.0, 1.0 / self.simulated.size][: len(start)]),
            loss=loss,
            f_scale=width,
            xtol=finest,
            ftol=finest,
            gtol=1e-15,
            max_nfev=100,
        )
        return np.asarray(found.x)

    def placement(self, p: Floats, others: tuple[float, ...]) -> Placement:
        size = float(np.exp(p[3])) if self.scale else 1.0
        shift = self.goal + p[1:3] - size * _rotation(p[0]) @ self.pivot
        turn = wrapped(float(np.degrees(p[0])))
        return Placement(
            turn, (float(shift[0]), float(shift[1]), 0.0), size, "outline", self.rms(p), others, self.turns
        )


def _rotation(turn: float) -> Floats:
    c, s = np.cos(turn), np.sin(turn)
    return np.array([[c, -s], [s, c]])


def _away(gaps: Floats, normals: Floats) -> tuple[Floats, Floats]:
    """Distances with the sign of the side and their unit directions; the normal where the distance vanishes."""
    sizes = np.linalg.norm(gaps, axis=1)
    signs = np.where((gaps * normals).sum(axis=1) < 0.0, -1.0, 1.0)
    touching = sizes < 1e-12
    directions = np.where(touching[:, None], normals, signs[:, None] * gaps / np.where(touching, 1.0, sizes)[:, None])
    return signs * sizes, directions


def _shares(pieces: Pieces) -> Floats:
    return np.asarray(pieces.lengths / pieces.lengths.sum())


def _weighted_median(values: Floats, weights: Floats) -> float:
    order = np.argsort(values)
    heap = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(heap, 0.5 * heap[-1])])


def _thinned(ring: Ring) -> Ring:
    """A ring of many points without those that change it by less than the registration can tell."""
    if len(ring.points) <= 5 * PIECES:
        return ring
    import shapely

    kept = shapely.get_coordinates(shapely.simplify(ring.line, 1e-4 * ring.size))[:-1]
    return Ring(kept)
