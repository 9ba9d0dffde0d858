"""The time loop: many steps of central differences per call, one sweep over the rows of the grid per step.

Order within a sweep, for each row: contact, then piece by piece its warp connectors with the cells and weft connectors above
and the update. Crossings are updated in place as soon as the cells around them are done. Threads take bands of rows and stay in
the loop; a band holds copies of its neighbours' edge rows (halos), refreshed before each step while all wait for each other
(:mod:`weftform.solver.team`), so no thread reads what another writes, and every row is computed by the same operations in
the same order whatever the number of bands.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numba
import numpy as np

from weftform.mechanics.compiled import FASTMATH
from weftform.mechanics.motion import motion_value, pushed_velocity
from weftform.solver import layout as at
from weftform.solver.contact_rows import face_row, friction_row, normal_row
from weftform.solver.fabric_rows import even_piece, invert_row, measure_row, pull_row, stress_row, tension_row, warp_row
from weftform.solver.layout import Layout
from weftform.solver.rows import carry_row, update_row
from weftform.solver.subnormals import flush_subnormals, restore_subnormals
from weftform.solver.survey import ON_FACE
from weftform.solver.team import meet, next_order
from weftform.solver.vector_loops import loop_part

# columns of the table of rigid tools
T_SHAPE = 0
T_HALF_THICKNESS = 5
T_STIFFNESS = 6
T_FRICTION = 7
T_TANGENTIAL = 8
T_MOTION = 9
T_MASS = 10
T_DAMPING = 11
TOOL_COLUMNS = 12

# columns of the state of rigid tools
P_Z = 0
P_VELOCITY = 1
P_REACTION = 2
P_LAST_Z = 3
P_LAST_DRIVE = 4
P_WORK = 5
P_DAMPED = 6
POSE_COLUMNS = 7

# the clock: what changes from step to step
C_TIME = 0
C_STEP = 1
C_LAST_STEP = 2
C_STEPS_DONE = 3
C_DRIVE_WORK = 4
C_INERTIA = 5
"""Factor on all masses of the fabric (variable mass scaling)."""
CLOCK_COLUMNS = 6

# a batch of steps: at most how many, up to which time, and the dashpots on the way
B_STEPS = 0
B_STOP = 1
B_VISCOSITY = 2
"""Share of critical damping times the area of a cell [mm2] (:attr:`weftform.solver.Simulation.viscosity`)."""
BATCH_COLUMNS = 3

IDENTITY, COSINE, SINE = 0, 1, 2
"""How a motion enters a direction of driven crossings: a, cos a - 1 or sin a."""


@loop_part
def _mode_amplitude(kind, value):
    if kind == COSINE:
        return np.cos(value) - 1.0
    if kind == SINE:
        return np.sin(value)
    return value


@loop_part
def _drive_crossings(
    state, nodes, driven_state, held, modes, mode_motion, mode_kind, motion_times, motion_values, motion_knots, ramps,
    time, share, amplitude, stride,
):  # fmt: skip
    """Give the driven crossings the velocity that takes them to where they belong at ``time``."""
    for m in range(mode_motion.shape[0]):
        k = mode_motion[m]
        value = motion_value(motion_times[k], motion_values[k], motion_knots[k], ramps, time)
        amplitude[m] = _mode_amplitude(mode_kind[m], value)
    for n in range(nodes.shape[0]):
        for c in range(3):
            if not held[n, c]:
                continue
            target = driven_state[n, c]
            for m in range(mode_motion.shape[0]):
                target += amplitude[m] * modes[m, n, c]
            place = nodes[n] + c * stride
            state[place + at.VELOCITY * stride] = (target - state[place]) * share


@loop_part
def _drive_work(state, nodes, driven_state, held, stride, force_field, step):
    """Work on the driven crossings: half of this step's way with this force, half with the next one's (trapezium)."""
    work = 0.0
    for n in range(nodes.shape[0]):
        place = nodes[n]
        for c in range(3):
            if not held[n, c]:
                continue
            now = state[place + (at.VELOCITY + c) * stride] * step
            work -= state[place + (force_field + c) * stride] * 0.5 * (now + driven_state[n, 3 + c])
            driven_state[n, 3 + c] = now
    return work


@loop_part
def _sweep_band(
    state, traits, trait_rows, band, bands, first, last, spans, edge, node, between, membrane, series,
    warp_law, weft_law, shear_law, ends, warp_inverse, weft_inverse,
    tool_table, poses, pieces, grip, reactions, heats, step, last_step, kick, keep, damping, viscosity,
    stride, row_length, trait_length, block, tools, half_cells, driven, force_field,
    warp_degree, warp_pieces, weft_degree, weft_pieces, shear_degree, shear_pieces,
):  # fmt: skip
    """One step of the rows ``first`` to ``last`` (halos included) of a band.

    ``spans`` holds for each row where its crossings begin and how many there are, the same for its warp edges
    (wider by what its neighbours have), and for the cells above it (:func:`weftform.solver.spans.row_spans`).
    ``pieces`` holds for each tool and row how many pieces of it can touch, then where each begins, its length and
    kind (:mod:`weftform.solver.survey`); ``grip`` the friction traction of each; ``heats`` sums per row the heat of
    damping and of friction with each tool.
    """
    for k in range(block):
        edge[block + k] = 0.0
        node[block + k] = 0.0
    own_first = first + (1 if band > 0 else 0)
    own_last = last - (1 if band < bands - 1 else 0)
    for r in range(first, own_last + 1):
        row = np.uint64(r) * np.uint64(row_length)
        trait = np.uint64(trait_rows[r]) * np.uint64(trait_length)
        if r >= own_first:
            for k in range(tools):
                reaction = 0.0
                heat = 0.0
                for m in range(pieces[k, r, 0, 0]):
                    begin = pieces[k, r, m + 1, 0]
                    place = row + np.uint64(begin)
                    there = trait + np.uint64(begin)
                    held = np.uint64((r * tools + k) * (3 * stride) + begin)
                    count = np.uint64(pieces[k, r, m + 1, 1])
                    if pieces[k, r, m + 1, 2] == ON_FACE:
                        axial, slipped = face_row(
                            state, place, traits, there, grip, held, count, node[begin:], stride, tool_table[k],
                            poses[k, P_Z], last_step,
                        )  # fmt: skip
                    else:
                        normal_row(state, place, count, between, stride, tool_table[k], poses[k, P_Z])
                        axial, slipped = friction_row(
                            state, place, traits, there, grip, held, count, between, node[begin:], stride, tool_table[k],
                            poses[k, P_Z] - poses[k, P_LAST_Z], last_step,
                        )  # fmt: skip
                    reaction += axial
                    heat += slipped
                reactions[k, r] = reaction
                heats[r, 1 + k] += heat
        begin, length = (spans[r, 4], spans[r, 5]) if r < last else (spans[r, 2], spans[r, 3])
        end = begin + length
        piece = even_piece(length)
        while begin < end:
            ahead = min(begin + piece, end)
            place = row + np.uint64(begin)
            there = trait + np.uint64(begin)
            count = np.uint64(ahead - begin)
            if r < last:
                measure_row(state, place, traits, there, count, between, stride, row_length, half_cells, membrane)
                invert_row(count, between)
                stress_row(
                    traits, there, count, between, stride, membrane, series, shear_degree, shear_pieces, shear_law, ends[2]
                )  # fmt: skip
                power = tension_row(
                    traits, there, count, between, stride,
                    warp_inverse, viscosity * warp_inverse * warp_inverse, warp_degree, warp_pieces, warp_law,
                    weft_inverse, viscosity * weft_inverse * weft_inverse, weft_degree, weft_pieces, weft_law, ends,
                )  # fmt: skip
                pull_row(
                    state, place, traits, there, count, between, edge[begin:], node[begin:], stride, row_length, half_cells,
                    membrane,
                )  # fmt: skip
            else:
                power = warp_row(
                    state, place, traits, there, count, edge[begin:], node[begin:], stride,
                    warp_inverse, viscosity * warp_inverse * warp_inverse, warp_degree, warp_pieces, warp_law, ends[0],
                )  # fmt: skip
            # the crossings of the piece have all their forces now, and no cell of a later piece starts from them
            begin = max(begin, spans[r, 2])
            count = np.uint64(max(min(ahead, spans[r, 2] + spans[r, 3]) - begin, 0))
            if r >= own_first:
                heats[r, 0] += step * power + update_row(
                    state, row + np.uint64(begin), traits, trait + np.uint64(begin), count, edge[begin:], node[begin:],
                    stride, step, kick, keep, damping, driven, force_field,
                )  # fmt: skip
            else:
                carry_row(count, edge[begin:], node[begin:], stride)
            begin = ahead


@loop_part
def _move_tools(
    tool_table, poses, reactions, motion_times, motion_values, motion_knots, ramps, time, step, mean_step
):  # fmt: skip
    """Place the tools for the next step: where their motion has them, or where force, reaction and inertia take them."""
    for k in range(tool_table.shape[0]):
        total = 0.0
        for r in range(reactions.shape[1]):
            total += reactions[k, r]
        motion = int(tool_table[k, T_MOTION])
        z = poses[k, P_Z]
        travelled = z - poses[k, P_LAST_Z]
        mass = tool_table[k, T_MASS]
        poses[k, P_REACTION] = total
        drive = total
        if mass > 0.0:
            drive = motion_value(motion_times[motion], motion_values[motion], motion_knots[motion], ramps, time)
            rate = tool_table[k, T_DAMPING]
            old = poses[k, P_VELOCITY]
            new = pushed_velocity(old, drive - total, mass, rate, mean_step)
            poses[k, P_DAMPED] += 0.25 * rate * mass * (old + new) * (old + new) * mean_step
            poses[k, P_VELOCITY] = new
            ahead = z + step * new
        elif motion >= 0:
            ahead = motion_value(motion_times[motion], motion_values[motion], motion_knots[motion], ramps, time + step)
        else:
            ahead = z
        poses[k, P_WORK] += 0.5 * (drive + poses[k, P_LAST_DRIVE]) * travelled
        poses[k, P_LAST_DRIVE] = drive
        poses[k, P_LAST_Z] = z
        poses[k, P_Z] = ahead


@cache
def compile_loop(layout: Layout) -> Callable[..., Any]:
    """The compiled time loop for a layout; kernels are cached on disk per user (see
    :mod:`weftform.solver.kernel_cache`).
    """
    stride = layout.stride
    row_length = layout.row
    block = layout.block
    tools = layout.tools
    half_cells = layout.half_cells
    driven = layout.driven
    trait_length = layout.traits * layout.stride
    force_field = layout.force
    warp_degree, warp_pieces = layout.warp_degree, layout.warp_pieces
    weft_degree, weft_pieces = layout.weft_degree, layout.weft_pieces
    shear_degree, shear_pieces = layout.shear_degree, layout.shear_pieces

    def advance(
        state, traits, trait_rows, bounds, halo_to, halo_from, spans, edge, node, between, membrane, series,
        warp_law, weft_law, shear_law, ends, warp_inverse, weft_inverse,
        tool_table, poses, pieces, grip, reactions, heats, motion_times, motion_values, motion_knots, ramps,
        driven_nodes, driven_state, driven_held, driven_modes, mode_motion, mode_kind, clock, batch, alpha, density,
        gate, band, order,
    ):  # fmt: skip
        """March a band through batches of steps, as long as there are orders after ``order`` (:mod:`weftform.solver.team`).

        Each band of the team calls it at the same time. What belongs to the whole sheet, its tools and its clock, is
        written by band 0 alone. Returns the number of steps of its last batch.
        """
        environment = flush_subnormals()
        bands = bounds.shape[0]
        first, last = bounds[band, 0], bounds[band, 1]
        own_edge, own_node, own_between = edge[band], node[band], between[band]
        amplitude = np.zeros(mode_motion.shape[0])
        done = 0
        while True:
            order = next_order(gate, band, order)
            if order == 0:
                break
            steps, stop, viscous = batch[B_STEPS], batch[B_STOP], batch[B_VISCOSITY]
            time, step, last_step, inertia = clock[C_TIME], clock[C_STEP], clock[C_LAST_STEP], clock[C_INERTIA]
            done = 0
            if not meet(gate, bands):
                break
            while done < steps and time < stop:
                mean_step = 0.5 * (step + last_step)
                keep = (1.0 - 0.5 * alpha * mean_step) / (1.0 + 0.5 * alpha * mean_step)
                kick = mean_step / ((1.0 + 0.5 * alpha * mean_step) * inertia)
                if driven:
                    if band == 0:
                        _drive_crossings(
                            state, driven_nodes, driven_state, driven_held, driven_modes, mode_motion, mode_kind, motion_times,
                            motion_values, motion_knots, ramps, time + step, 1.0 / (step * keep), amplitude, stride,
                        )  # fmt: skip
                    meet(gate, bands)
                for h in range(halo_to.shape[0]):
                    if first <= halo_to[h] <= last:
                        source = halo_from[h] * row_length
                        target = halo_to[h] * row_length
                        for k in range(6 * stride):
                            state[target + k] = state[source + k]
                meet(gate, bands)
                _sweep_band(
                    state, traits, trait_rows, band, bands, first, last, spans, own_edge,
                    own_node, own_between, membrane, series, warp_law, weft_law, shear_law, ends, warp_inverse, weft_inverse,
                    tool_table, poses, pieces, grip, reactions, heats, step, last_step, kick, keep,
                    0.25 * alpha * density * inertia * mean_step,
                    viscous * density * inertia / step,
                    stride, row_length, trait_length, block, tools, half_cells, driven, force_field,
                    warp_degree, warp_pieces, weft_degree, weft_pieces, shear_degree, shear_pieces,
                )  # fmt: skip
                meet(gate, bands)
                if band == 0:
                    _move_tools(
                        tool_table, poses, reactions, motion_times, motion_values, motion_knots, ramps, time, step, mean_step
                    )  # fmt: skip
                    if driven:
                        clock[C_DRIVE_WORK] += _drive_work(
                            state, driven_nodes, driven_state, driven_held, stride, force_field, step
                        )
                time += step
                last_step = step
                done += 1
            if band == 0:
                clock[C_TIME] = time
                clock[C_LAST_STEP] = last_step
                clock[C_STEPS_DONE] += done
        restore_subnormals(environment)
        return done

    return numba.njit(fastmath=FASTMATH, error_model="numpy", cache=True, nogil=True)(advance)
