"""How tools move: smooth prescribed motions, soft at each knot, and a rigid body that a force pushes."""

from __future__ import annotations

from typing import Any

from weftform.mechanics.compiled import scalar


@scalar
def peak_speed(ramp: float, end_ramp: float) -> float:
    """Speed between the ramps of :func:`soft_progress`, as a multiple of the mean: a ramp makes half the way of its time."""
    return 1.0 / (1.0 - 0.5 * (ramp + end_ramp))


@scalar
def soft_progress(progress: float, ramp: float, end_ramp: float) -> float:
    """Travelled share (0..1) at the time share ``progress``: constant speed but for a ramp at each end.

    In a ramp the speed follows the smooth step ``3 x^2 - 2 x^3``, so acceleration is continuous and starts
    from zero; the speed between the ramps is :func:`peak_speed` times the mean. ``ramp`` and ``end_ramp`` are the
    shares of the time in which speed is gathered and lost, each in ``]0, 0.5]``.
    """
    peak = peak_speed(ramp, end_ramp)
    if progress <= 0.0:
        return 0.0
    if progress >= 1.0:
        return 1.0
    if progress < ramp:
        x = progress / ramp
        return peak * ramp * x * x * x * (1.0 - 0.5 * x)
    if progress > 1.0 - end_ramp:
        x = (1.0 - progress) / end_ramp
        return 1.0 - peak * end_ramp * x * x * x * (1.0 - 0.5 * x)
    return peak * (progress - 0.5 * ramp)


@scalar
def motion_value(times: Any, values: Any, knots: int, ramps: Any, time: float) -> float:
    """Value at ``time`` of a motion through ``knots`` points, with ``ramps`` (first, last) between each pair."""
    value: float = values[0]
    if time <= times[0]:
        return value
    for k in range(knots - 1):
        if time < times[k + 1]:
            progress = (time - times[k]) / (times[k + 1] - times[k])
            value = values[k] + (values[k + 1] - values[k]) * soft_progress(progress, ramps[0], ramps[1])
            return value
    value = values[knots - 1]
    return value


@scalar
def pushed_velocity(old: float, force: float, mass: float, rate: float, step: float) -> float:
    """Velocity half a step later of a body of ``mass`` [tonne] under a force [N], damped by ``rate`` [1/s].

    Central differences with the damping on the mean of old and new velocity; it takes
    ``rate mass (old + new)^2 step / 4`` of energy.
    """
    return (old * (1.0 - 0.5 * rate * step) + step * force / mass) / (1.0 + 0.5 * rate * step)
