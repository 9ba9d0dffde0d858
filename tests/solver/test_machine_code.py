"""The loops over a row are vector code: what the compiler made of them, read back.

Each loop is compiled alone with the constants of a small problem, as it is when it is inlined into the time loop (there
the cache hides the machine code). Which registers it must use follows from what the processor says it has.
"""

from __future__ import annotations

import platform
import re

import llvmlite.binding as llvm
import numba
import numpy as np
import pytest
from small_problems import bias_grid, pressed, whole_grid

from weftform.mechanics.compiled import FASTMATH
from weftform.solver import contact_rows, fabric_rows, rows, survey

MACHINE = platform.machine().lower()
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(MACHINE not in ("x86_64", "amd64"), reason="reads the machine code of x86-64"),
]

FEATURES = llvm.get_host_cpu_features() if MACHINE in ("x86_64", "amd64") else {}
REGISTER = "zmm" if FEATURES.get("avx512f") else "ymm" if FEATURES.get("avx2") else "xmm"
JUMP = re.compile(r"j\w+\s+(\.?[\w$.]+)")


def innermost_loops(assembly):
    """Bodies of the loops that hold no other loop, as lists of instructions."""
    labels, code = {}, []
    for line in assembly.splitlines():
        label = re.match(r"(\.?[\w$.]+):", line)
        if label:
            labels[label[1]] = len(code)
        elif (text := line.strip()) and not text.startswith((".", "#")):
            code.append(text)
    found = []
    for end, text in enumerate(code):
        jump = JUMP.match(text)
        if jump and labels.get(jump[1], end + 1) <= end:
            body = code[labels[jump[1]] : end + 1]
            if not any(JUMP.match(other) for other in body[:-1]):
                found.append(body)
    return found


def vector_loop(function, *arguments):
    """The innermost loop with most operations on the widest registers."""
    compiled = numba.njit(fastmath=FASTMATH, error_model="numpy")(function)
    compiled(*arguments)
    loops = innermost_loops(compiled.inspect_asm(compiled.signatures[0]))

    def packed(body):
        return [text for text in body if re.match(r"v?\w+pd\b", text) and REGISTER in text]

    body = max(loops, key=lambda loop: len(packed(loop)), default=[])
    assert not any(text.startswith("call") for text in body)
    scalar = [text for text in body if re.match(r"v?(add|sub|mul|div|sqrt|fn?m(add|sub)\w*)sd\b", text)]
    assert not scalar
    return packed(body)


def operations(body, pattern):
    return [text for text in body if re.match(rf"v?{pattern}\w*pd\b", text)]


@pytest.fixture(scope="module")
def problem():
    return pressed(whole_grid(12, 10), friction=0.2)


def places(simulation):
    sheet, machine, layout = simulation.sheet, simulation.machine, simulation.layout
    row = np.uint64(4 * layout.row)
    trait = np.uint64(sheet.trait_rows[4] * layout.traits * layout.stride)
    count = np.uint64(sheet.spans[4, 1])
    return sheet.state.reshape(-1), row, sheet.traits.reshape(-1), trait, count, machine.grip.reshape(-1)


@pytest.mark.parametrize("cells", ["whole", "half"])
def test_cells_and_connectors(problem, cells):
    """All five loops of a piece; roots and quotients only where the divider has time for them."""
    problem = problem if cells == "whole" else pressed(bias_grid(5), friction=0.2)
    layout, material, sheet = problem.layout, problem.material, problem.sheet
    stride, length, halves = layout.stride, layout.row, layout.half_cells
    wd, wp, fd, fp, sd, sp = material.shapes
    state, row, traits, trait, count, _ = places(problem)
    between, edge, node = sheet.between[0], sheet.edge[0], sheet.node[0]
    membrane, series, ends = tuple(material.membrane), tuple(material.series), material.ends
    warp, weft, shear = material.loop_laws

    def measure(state, row, traits, trait, count, between, membrane):
        fabric_rows.measure_row(state, row, traits, trait, count, between, stride, length, halves, membrane)

    def invert(count, between):
        fabric_rows.invert_row(count, between)

    def stress(traits, trait, count, between, membrane, series, shear, ends):
        fabric_rows.stress_row(traits, trait, count, between, stride, membrane, series, sd, sp, shear, ends[2])

    def tension(traits, trait, count, between, warp, weft, ends):
        fabric_rows.tension_row(
            traits, trait, count, between, stride, 0.3, 1e-6, wd, wp, warp, 0.3, 1e-6, fd, fp, weft, ends
        )

    def pull(state, row, traits, trait, count, between, edge, node, membrane):
        fabric_rows.pull_row(state, row, traits, trait, count, between, edge, node, stride, length, halves, membrane)

    def found(body):
        return [len(operations(body, pattern)) for pattern in ("sqrt", "div", "(mul|add|sub|fn?m)")]

    roots, quotients, others = found(vector_loop(measure, state, row, traits, trait, count, between, membrane))
    assert (roots, quotients) == (1, 0)
    assert others > 40
    roots, quotients, others = found(vector_loop(invert, count, between))
    assert (roots, quotients) == (0, 2)
    assert others > 30
    roots, quotients, others = found(vector_loop(stress, traits, trait, count, between, membrane, series, shear, ends))
    assert (roots, quotients) == (0, 0)
    assert others > 45
    roots, quotients, others = found(vector_loop(tension, traits, trait, count, between, warp, weft, ends))
    assert (roots, quotients) == (0, 1)
    assert others > 30
    roots, quotients, others = found(vector_loop(pull, state, row, traits, trait, count, between, edge, node, membrane))
    assert (roots, quotients) == (0, 0)
    assert others > 40


def test_last_row(problem):
    layout, material, sheet = problem.layout, problem.material, problem.sheet
    stride = layout.stride
    degree, pieces = material.shapes[:2]
    state, row, traits, trait, count, _ = places(problem)

    def kernel(state, row, traits, trait, count, edge, node, law, ends):
        fabric_rows.warp_row(
            state, row, traits, trait, count, edge, node, stride, 0.3, 1e-6, degree, pieces, law, ends[0]
        )

    body = vector_loop(
        kernel, state, row, traits, trait, count, sheet.edge[0], sheet.node[0], material.loop_laws[0], material.ends
    )
    assert len(operations(body, "(mul|add|sub|fn?m)")) > 25


def test_crossings(problem):
    layout, sheet = problem.layout, problem.sheet
    stride, driven, force = layout.stride, layout.driven, layout.force
    state, row, traits, trait, count, _ = places(problem)

    def kernel(state, row, traits, trait, count, edge, node):
        return rows.update_row(
            state, row, traits, trait, count, edge, node, stride, 1e-7, 1e-7, 0.999, 1e-9, driven, force
        )

    body = vector_loop(kernel, state, row, traits, trait, count, sheet.edge[0], sheet.node[0])
    assert len(operations(body, "(mul|add|sub|fn?m)")) > 25


@pytest.mark.parametrize("how", ["face", "normal", "friction"])
def test_contact(problem, how):
    layout, sheet, machine = problem.layout, problem.sheet, problem.machine
    stride = layout.stride
    state, row, traits, trait, count, grip = places(problem)
    between, node, tool, held = sheet.between[0], sheet.node[0], machine.tools[0], np.uint64(0)

    def face(state, row, traits, trait, grip, held, count, node, tool):
        contact_rows.face_row(state, row, traits, trait, grip, held, count, node, stride, tool, 0.0, 1e-6)

    def normal(state, row, count, between, tool):
        contact_rows.normal_row(state, row, count, between, stride, tool, 0.0)

    def friction(state, row, traits, trait, grip, held, count, between, node, tool):
        contact_rows.friction_row(state, row, traits, trait, grip, held, count, between, node, stride, tool, 0.0, 1e-6)

    kernel, arguments, least = {
        "face": (face, (state, row, traits, trait, grip, held, count, node, tool), 20),
        "normal": (normal, (state, row, count, between, tool), 25),
        "friction": (friction, (state, row, traits, trait, grip, held, count, between, node, tool), 20),
    }[how]
    body = vector_loop(kernel, *arguments)
    assert not operations(body, "(div|sqrt)")
    assert len(operations(body, "(mul|add|sub|fn?m)")) >= least


def test_survey(problem):
    layout, machine = problem.layout, problem.machine
    stride = layout.stride
    state, row, traits, trait, count, _ = places(problem)

    def kernel(state, row, traits, trait, count, tool, gap, inward):
        survey.gap_row(state, row, traits, trait, count, stride, tool, 0.0, gap, inward)

    out = np.zeros((2, stride))
    assert vector_loop(kernel, state, row, traits, trait, count, machine.tools[0], out[0], out[1])


def test_loops_of_a_row_are_found():
    text = "a:\n mov x\n.L1:\n addpd y\n jne .L1\n jmp b\n.L2:\n.L3:\n mulpd\n jne .L3\n jne .L2\n"
    assert innermost_loops(text) == [["addpd y", "jne .L1"], ["mulpd", "jne .L3"]]
