"""One step of the time loop in one launch.

A block has a tile of *elements*: the element (i, j) is the cell above and to the right of the crossing (i, j) and the
two connectors that start there. First every element of the tile is computed once, and what it does to its corners is
left in shared memory; then every crossing but those of the first row and column of the tile, whose other elements
belong to the neighbouring tiles, gathers from its four elements, adds contact, and moves. No two threads write
the same place and nothing is added atomically, so a run repeats bit for bit.

Crossings move from one buffer of positions and velocities to another. The block that finishes last sums the tool
forces of all blocks, in their order, and moves the tools. Each thread keeps the sums of heat of its crossings.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numba
import numpy as np
from numba import cuda

from weftform.mechanics.motion import pushed_velocity
from weftform.solver import layout as at
from weftform.solver.cuda.elements import cell_forces, line_force, tool_traction
from weftform.solver.cuda.functions import combine, device_function, dot, minus, put_vector, vector_at
from weftform.solver.cuda.launch import (
    COMPILE_ONLY,
    MOVING,
    S_DAMPING,
    S_KEEP,
    S_KICK,
    S_LAST_STEP,
    S_SHARE,
    S_STEP,
    S_TOOLS,
    S_VISCOSITY,
    SLOTS,
    Constants,
    Tile,
    kept_fields,
)
from weftform.solver.layout import Layout
from weftform.solver.loop import (
    P_DAMPED,
    P_LAST_DRIVE,
    P_LAST_Z,
    P_REACTION,
    P_VELOCITY,
    P_WORK,
    P_Z,
    T_DAMPING,
    T_MASS,
    T_MOTION,
)
from weftform.solver.survey import CLEAR, ON_FACE


@device_function
def move_tool(tools, poses, k, total, planned, step, mean_step):
    """Book the reaction ``total`` of tool ``k`` and move it: by its motion, or as a rigid body pushed by a force."""
    z = poses[k, P_Z]
    travelled = z - poses[k, P_LAST_Z]
    mass = tools[k, T_MASS]
    poses[k, P_REACTION] = total
    drive = total
    ahead = z
    if mass > 0.0:
        drive = planned
        rate = tools[k, T_DAMPING]
        old = poses[k, P_VELOCITY]
        new = pushed_velocity(old, drive - total, mass, rate, mean_step)
        poses[k, P_DAMPED] += 0.25 * rate * mass * (old + new) * (old + new) * mean_step
        poses[k, P_VELOCITY] = new
        ahead = z + step * new
    elif tools[k, T_MOTION] >= 0.0:
        ahead = planned
    poses[k, P_WORK] += 0.5 * (drive + poses[k, P_LAST_DRIVE]) * travelled
    poses[k, P_LAST_DRIVE] = drive
    poses[k, P_LAST_Z] = z
    poses[k, P_Z] = ahead


@cache
def compile_sweep(layout: Layout, constants: Constants, tile: Tile) -> Any:
    """The kernel of one step for a layout, laws and tile."""
    # Unsigned, so that no index is tested for counting from the end
    stride = np.uint64(layout.stride)
    columns, rows = constants.columns, constants.rows
    wide, size, threads = tile.columns, tile.columns * tile.rows, tile.threads
    own_columns, own_rows = tile.columns - 1, tile.rows - 1
    moving_row, kept_row, traits_row, grip_row = (
        fields * layout.stride for fields in (MOVING, kept_fields(layout), layout.traits, 3)
    )
    up = np.uint64(moving_row)
    one = np.uint64(1)
    velocity = np.uint64(at.VELOCITY * layout.stride)
    inverse_mass, area_field, inertia_field, warp_line, weft_line, volume_field = (
        np.uint64(field * layout.stride)
        for field in (at.INVERSE_MASS, at.AREA, at.INERTIA, at.WARP_LINE, at.WEFT_LINE, at.VOLUME)
    )
    lower_weight, left_weight, mirror_field, mirror_z_field = (
        np.uint64(field * layout.stride) for field in (at.LOWER_WEIGHT, at.LEFT_WEIGHT, at.MIRROR, at.MIRROR_Z)
    )
    half_cells, driven, tools = bool(layout.half_cells), bool(layout.driven), layout.tools
    force_field = np.uint64((at.MEMORY + layout.force - MOVING) * layout.stride)
    sums = tools + layout.driven
    accumulators = SLOTS * size
    last_flag = accumulators + sums * threads
    modes = constants.modes
    first_mode = S_TOOLS + tools
    warp_law, weft_law, shear_law = constants.warp_law, constants.weft_law, constants.shear_law
    series, membrane = constants.series, constants.membrane
    i1, i2 = membrane[0], membrane[1]

    @device_function
    def corner(shared, element, first):
        """What an element does to a corner: 0 the right one, 3 the upper, 6 the opposite."""
        place = first * size + element
        return shared[place], shared[place + size], shared[place + 2 * size]

    @device_function
    def leave(shared, element, first, force):
        """Leave a force for the crossing at a corner."""
        place = first * size + element
        shared[place] = force[0]
        shared[place + size] = force[1]
        shared[place + 2 * size] = force[2]

    @device_function
    def compute_element(moving, traits, shared, element, m, t, viscosity):
        """Forces of the cell and connectors of the crossing at ``m`` on the other three corners; traits are at ``t``."""
        right = (0.0, 0.0, 0.0)
        upper = (0.0, 0.0, 0.0)
        opposite = (0.0, 0.0, 0.0)
        heat = 0.0
        warp = traits[t + warp_line]
        weft = traits[t + weft_line]
        volume = traits[t + volume_field]
        here = vector_at(moving, m, stride)
        pace = vector_at(moving, m + velocity, stride)
        if warp > 0.0:
            way = minus(vector_at(moving, m + one, stride), here)
            rate = minus(vector_at(moving, m + one + velocity, stride), pace)
            pull, power = line_force(way, rate, warp, i1, viscosity * i1 * i1, warp_law)
            right = minus(right, pull)
            heat += power
        if weft > 0.0:
            way = minus(vector_at(moving, m + up, stride), here)
            rate = minus(vector_at(moving, m + up + velocity, stride), pace)
            pull, power = line_force(way, rate, weft, i2, viscosity * i2 * i2, weft_law)
            upper = minus(upper, pull)
            heat += power
        if volume > 0.0:
            b = vector_at(moving, m + one, stride)
            c = vector_at(moving, m + up, stride)
            d = vector_at(moving, m + up + one, stride)
            low = 0.5
            near = 0.5
            mirror = 0.0
            mirror_z = 0.0
            if half_cells:
                low = traits[t + lower_weight]
                near = traits[t + left_weight]
                mirror = traits[t + mirror_field]
                mirror_z = traits[t + mirror_z_field]
            along_lower, along_upper, along_left, along_right = cell_forces(
                minus(b, here), minus(d, c), minus(c, here), minus(d, b),
                low, near, mirror, mirror_z, volume, membrane, shear_law, series,
            )  # fmt: skip
            right = combine(1.0, right, 1.0, minus(along_right, along_lower))
            upper = combine(1.0, upper, 1.0, minus(along_upper, along_left))
            opposite = combine(-1.0, along_upper, -1.0, along_right)
        leave(shared, element, 0, right)
        leave(shared, element, 3, upper)
        leave(shared, element, 6, opposite)
        shared[9 * size + element] = heat

    @device_function
    def gather(shared, element):
        """Internal force on a crossing. What an element does to its own crossing balances the other three corners."""
        right = corner(shared, element, 0)
        upper = corner(shared, element, 3)
        opposite = corner(shared, element, 6)
        from_left = corner(shared, element - 1, 0)
        from_below = corner(shared, element - wide, 3)
        from_both = corner(shared, element - wide - 1, 6)
        own = combine(1.0, combine(1.0, right, 1.0, upper), 1.0, opposite)
        other = combine(1.0, combine(1.0, from_left, 1.0, from_below), 1.0, from_both)
        return minus(other, own)

    @device_function
    def touch(
        grip, heats, account, area, i, row, position, pace, force, table, poses, touching, last_step, shared, thread
    ):  # fmt: skip
        """Add the forces of the tools that the row can touch."""
        for k in range(tools):
            stand = touching[k, row]
            if stand == CLEAR:
                continue
            place = np.uint64((row * tools + k) * grip_row + i)
            before = vector_at(grip, place, stride)
            on, held, heat = tool_traction(
                position, pace, before, table, k, poses[k, P_Z], poses[k, P_Z] - poses[k, P_LAST_Z], last_step,
                stand == ON_FACE,
            )  # fmt: skip
            # most crossings of a row that can touch do not: nothing to store
            if held[0] != before[0] or held[1] != before[1] or held[2] != before[2]:
                put_vector(grip, place, stride, held)
            if heat != 0.0:
                heats[1 + k, account] += area * heat
            force = combine(1.0, force, area, on)
            shared[accumulators + k * threads + thread] += area * on[2]
        return force

    @device_function
    def drive(kept, n, m, force, new, step, schedule, s, place, held, modes_of, state):
        """Book the work on a driven crossing and give it the velocity of the next step; returns the work."""
        put_vector(kept, n + force_field, stride, force)
        work = 0.0
        for c in range(3):
            if held[place, c] == 0:
                continue
            at_c = m + np.uint64(c) * stride
            way = new[at_c + velocity] * step
            work -= force[c] * 0.5 * (way + state[place, 3 + c])
            state[place, 3 + c] = way
            share = schedule[s + 1, S_SHARE]
            if share > 0.0:
                target = state[place, c]
                for mode in range(modes):
                    target += schedule[s + 1, first_mode + mode] * modes_of[mode, place, c]
                new[at_c + velocity] = (target - new[at_c]) * share
        return work

    def sweep(
        moving, new, kept, traits, trait_rows, grip, heats, table, poses, touching, schedule, s, partial, finished,
        driven_place, held, modes_of, state, drive_work,
    ):  # fmt: skip
        if s == COMPILE_ONLY:
            return
        shared = cuda.shared.array(0, numba.float64)
        thread = cuda.threadIdx.x
        # read once: after the first store nothing tells the compiler that the schedule is still the same
        step, last_step = schedule[s, S_STEP], schedule[s, S_LAST_STEP]
        kick, keep = schedule[s, S_KICK], schedule[s, S_KEEP]
        damping, viscosity = schedule[s, S_DAMPING], schedule[s, S_VISCOSITY]
        first_column = cuda.blockIdx.x * own_columns - 1
        first_row = cuda.blockIdx.y * own_rows - 1
        touched = 0
        for element in range(thread, size, threads):
            i = first_column + element % wide
            j = first_row + element // wide
            if 0 <= i < columns and 0 <= j < rows:
                m = np.uint64(j * moving_row + i)
                t = np.uint64(trait_rows[j] * traits_row + i)
                compute_element(moving, traits, shared, element, m, t, viscosity)
                for k in range(tools):
                    if touching[k, j] != CLEAR:
                        touched = 1
                if driven and driven_place[j, i] >= 0:
                    touched = 1
            else:
                for slot in range(SLOTS):
                    shared[slot * size + element] = 0.0
        for k in range(sums):
            shared[accumulators + k * threads + thread] = 0.0
        block_sums = cuda.syncthreads_or(touched)

        block = cuda.blockIdx.y * cuda.gridDim.x + cuda.blockIdx.x
        account = block * threads + thread
        damped = 0.0
        for element in range(thread, size, threads):
            i = first_column + element % wide
            j = first_row + element // wide
            if element % wide == 0 or element < wide or i >= columns or j >= rows:
                continue
            m = np.uint64(j * moving_row + i)
            t = np.uint64(trait_rows[j] * traits_row + i)
            area = traits[t + area_field]
            if area <= 0.0:
                continue
            position = vector_at(moving, m, stride)
            pace = vector_at(moving, m + velocity, stride)
            inner = gather(shared, element)
            force = inner
            if tools > 0:
                force = touch(
                    grip, heats, account, area, i, j, position, pace, inner, table, poses, touching, last_step, shared,
                    thread,
                )  # fmt: skip
            inverse = vector_at(traits, t + inverse_mass, stride)
            after = (
                keep * pace[0] + kick * inverse[0] * force[0],
                keep * pace[1] + kick * inverse[1] * force[1],
                keep * pace[2] + kick * inverse[2] * force[2],
            )
            put_vector(new, m + velocity, stride, after)
            put_vector(new, m, stride, combine(1.0, position, step, after))
            twice = combine(1.0, pace, 1.0, after)
            damped += damping * traits[t + inertia_field] * dot(twice, twice) + step * shared[9 * size + element]
            if driven:
                place = driven_place[j, i]
                if place >= 0:
                    shared[accumulators + tools * threads + thread] += drive(
                        kept, np.uint64(j * kept_row + i), m, inner, new, step, schedule, s, place, held, modes_of, state
                    )  # fmt: skip
        heats[0, account] += damped

        if sums == 0:
            return
        blocks = cuda.gridDim.x * cuda.gridDim.y
        if block_sums:
            add_up(shared, thread)
        if thread == 0:
            for k in range(sums):
                partial[k, block] = shared[accumulators + k * threads]
            cuda.threadfence()
            shared[last_flag] = 1.0 if cuda.atomic.add(finished, 0, 1) == blocks - 1 else 0.0
        cuda.syncthreads()
        if shared[last_flag] == 0.0:
            return
        cuda.threadfence()
        for k in range(sums):
            total = 0.0
            for b in range(thread, blocks, threads):
                total += partial[k, b]
            shared[accumulators + k * threads + thread] = total
        add_up(shared, thread)
        if thread == 0:
            finished[0] = 0
            mean_step = 0.5 * (step + last_step)
            for k in range(tools):
                move_tool(
                    table, poses, k, shared[accumulators + k * threads], schedule[s, S_TOOLS + k], step, mean_step
                )
            if driven:
                drive_work[0] += shared[accumulators + tools * threads]

    def add_up_plain(shared, thread):
        """Sum over the threads of a block, always in the same order; the totals are left with thread 0."""
        width = threads
        cuda.syncthreads()
        while width > 1:
            half = (width + 1) // 2
            if thread < width - half:
                for k in range(sums):
                    place = accumulators + k * threads + thread
                    shared[place] += shared[place + half]
            cuda.syncthreads()
            width = half

    add_up = cuda.jit(device=True)(add_up_plain)
    return cuda.jit(sweep)


@cuda.jit
def start_driven(moving, schedule, stride, first_mode, driven_nodes, held, modes_of, state):
    """Give driven crossings the velocity of the first step of a batch (:data:`S_SHARE`)."""
    place = cuda.grid(1)
    if place >= driven_nodes.shape[0]:
        return
    for c in range(3):
        if held[place, c] == 0:
            continue
        target = state[place, c]
        for mode in range(modes_of.shape[0]):
            target += schedule[0, first_mode + mode] * modes_of[mode, place, c]
        at_c = driven_nodes[place] + c * stride
        moving[at_c + 3 * stride] = (target - moving[at_c]) * schedule[0, S_SHARE]
