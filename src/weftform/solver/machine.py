"""What moves the blank, as the compiled loops take it: rigid tools, motions and driven crossings."""

from __future__ import annotations

import numpy as np

from weftform.mechanics.compiled import python_function
from weftform.mechanics.motion import motion_value, peak_speed
from weftform.solver import layout as at
from weftform.solver import loop
from weftform.solver.problem import Motion, Problem
from weftform.solver.sheet import Sheet, aligned

value_of_motion = python_function(motion_value)
"""For the calls from Python: there are few, and compiling it takes longer."""


class Machine:
    """Tables of tools, motions and driven crossings.

    Attributes
    ----------
    tools, poses
        Constants and state of each rigid tool, columns as in :mod:`weftform.solver.loop`.
    times, values, knots
        Motions, shape [motions, knots].
    legs
        Of each motion: where its legs begin and end [s], and their peak speeds.
    springs
        Stiffness of the contact of each tool with the whole blank [N/mm].
    pieces
        Pieces of rows that each tool can touch (:mod:`weftform.solver.survey`).
    grip
        Friction traction of each tool on each crossing [MPa], shape [local rows, tools, 3, stride].
    reactions
        Axial force of each tool on each local row [N].
    heats
        Per local row: heat of damping [mJ], then friction heat with each tool times its tangential stiffness.
    nodes, driven, held, modes, mode_motion, mode_kind
        Driven crossings: place in the state, start and last way, components that follow, modes and their motions.
    """

    def __init__(self, problem: Problem, sheet: Sheet) -> None:
        self.ramps = problem.settings.ramps
        self._place_tools(problem)
        self.springs = self.tools[:, loop.T_STIFFNESS] * float(problem.grid.node_area.sum())
        tools = len(problem.tools)
        self.pieces = np.zeros((tools, sheet.local_rows, 1 + at.blocks_for(sheet.columns), 3), np.int32)
        self.grip = aligned((sheet.local_rows, tools, 3, sheet.layout.stride))
        self.reactions = np.zeros((tools, sheet.local_rows))
        self.heats = np.zeros((sheet.local_rows, 1 + tools))
        self._drive_crossings(problem, sheet)

    def _place_tools(self, problem: Problem) -> None:
        tools = problem.tools
        half = 0.5 * problem.fabric.thickness
        self.tools = np.zeros((len(tools), loop.TOOL_COLUMNS))
        self.poses = np.zeros((len(tools), loop.POSE_COLUMNS))
        motions = list(problem.motions)
        for row, tool in zip(self.tools, tools, strict=True):
            row[:5] = tool.side_s, tool.s0, tool.side_z, tool.z0, tool.radius
            row[5:9] = half, tool.stiffness, tool.friction, tool.tangential_ratio
            row[loop.T_MOTION] = problem.stroke if tool.motion == "stroke" else -1
            if tool.motion == "force":
                share = motions[problem.holding]
                force = tool.up * tool.force / problem.grid.copies
                row[loop.T_MOTION] = len(motions)
                motions.append(Motion(share.times, tuple(force * v for v in share.values)))
                row[loop.T_MASS] = tool.mass / problem.grid.copies if tool.mass else np.nan
            elif tool.motion == "stroke" and tool.up < 0:
                stroke = motions[problem.stroke]
                row[loop.T_MOTION] = len(motions)
                motions.append(Motion(stroke.times, tuple(-v for v in stroke.values)))
        most = max([len(m.times) for m in motions], default=1)
        self.times = np.zeros((max(len(motions), 1), most))
        self.values = np.zeros_like(self.times)
        self.knots = np.ones(max(len(motions), 1), np.int64)
        for k, motion in enumerate(motions):
            n = len(motion.times)
            self.times[k, :n] = motion.times
            self.values[k, :n] = motion.values
            self.knots[k] = n
        peak = python_function(peak_speed)(*self.ramps)
        self.legs = [
            (times[:-1], times[1:], peak * np.abs(np.diff(values)) / np.maximum(np.diff(times), 1e-300))
            for times, values in ((np.array(motion.times), np.array(motion.values)) for motion in motions)
        ]

    def _drive_crossings(self, problem: Problem, sheet: Sheet) -> None:
        driven = problem.driven
        if driven is None:
            self.nodes = np.zeros(0, np.int64)
            self.driven = np.zeros((0, 6))
            self.held = np.zeros((0, 3), np.bool_)
            self.modes = np.zeros((0, 0, 3))
            self.mode_motion = np.zeros(0, np.int64)
            self.mode_kind = np.zeros(0, np.int64)
            return
        row, column = np.divmod(driven.nodes, sheet.columns)
        local = sheet.row_index[row]
        self.nodes = local * sheet.layout.row + column
        self.driven = np.zeros((len(driven.nodes), 6))
        for c in range(3):
            self.driven[:, c] = sheet.state[local, at.POSITION + c, column]
        self.held = np.ascontiguousarray(driven.held)
        sheet.hold(row, column, self.held)
        self.modes = np.ascontiguousarray(driven.modes)
        self.mode_motion = np.asarray(driven.motions, np.int64)
        self.mode_kind = np.asarray(driven.kinds, np.int64)

    def longest_way(self, time: float, span: float) -> float:
        """The longest way that a tool can make from ``time`` on in ``span`` seconds [mm], as a bound.

        Of a tool with a prescribed motion by its peak speed (:func:`weftform.mechanics.motion.soft_progress`), of one that
        is pushed by its force alone.
        """
        longest = 0.0
        for tool in self.tools:
            motion = int(tool[loop.T_MOTION])
            if motion < 0:
                continue
            if tool[loop.T_MASS] == 0.0:
                begin, end, speed = self.legs[motion]
                soon = (end > time) & (begin < time + span)
                longest = max(longest, float((speed * soon).max(initial=0.0)) * span)
            elif tool[loop.T_MASS] > 0.0:  # it has none before the first step is known
                force = float(np.abs(self.values[motion]).max())
                longest = max(longest, 0.5 * force / tool[loop.T_MASS] * span * span)
        return longest

    def motion(self, index: int, time: float) -> float:
        """Value of a motion at a time."""
        return float(value_of_motion(self.times[index], self.values[index], self.knots[index], self.ramps, time))
