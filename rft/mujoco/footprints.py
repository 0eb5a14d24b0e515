"""Ground that remembers: heights on a grid, which geoms press down and heap up, and which slide at the angle of repose.

Heights are counted from the undisturbed surface. What one simulation remembers lies in the ``userdata`` of its MjData, all
zeros for undisturbed ground, so that copies, resets and batches of MuJoCo carry it along. Whenever the time has changed,

- points on the surface of each geom press the cells that they are in down to the deepest point. The cell is lowered once
  the geom has left it; until then the geom goes on to see the ground as it was;
- the volume that is pressed away is heaped on the cells around the geom, in all directions in proportion to its speed
  down, and ahead of it in proportion to its speed along (assumed);
- where the ground is steeper than the angle of repose, the excess slides to the neighbours, in a tenth of the time in which
  grains fall by one cell (assumed). Cells under geoms neither give nor take.

Each geom bears what it bears in level ground of the mean height of the cells where it is in the ground. The heap that it
has raised since it was last out of the ground does not count: the stresses of the laws were measured with such a heap.
Geoms wholly below the ground press nothing: grains close behind them (assumed). Compiled code takes these functions, too."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from rft.core.checks import Number, check_numbers
from rft.core.metres import GRAVITY
from rft.core.refusal import require
from rft.laws.catalogue import REPOSE
from rft.mujoco.hills import tangent_plane

MOST_CELLS = 1_000_000
EVERY = 256.0  # steps: how often the highest ground is looked for again
RIM = 2  # cells: how far around a geom its heap is raised at once, assumed
SHARE = 0.25  # of the excess of a slope that slides in one step at most; with more, left and right differ more
SLIDES = (
    0.1  # time in which an excess slides over that in which grains fall by one cell
)
STEEPER = 1e-3  # share by which a slope may be steeper than it should
HEAD, PER_GEOM, PER_CELL = 8, 7, 5  # numbers that a simulation remembers
TIME, STAMP, TOP, BOX, FORM = 0, 1, 2, 3, 7  # places in the head; the box takes four


@dataclass(frozen=True)
class Footprints:
    """Ground that remembers, on a grid of cells.

    spacing: of the cells, m. length, width: of the grid along x and y, m, around the place ``x``, ``y``; the ground beyond it
    remembers nothing. repose: rad; the default is that of `rft.terradynamics.ground.Slope`.

    Examples
    --------
    >>> from rft.mujoco import Footprints
    >>> Footprints(spacing=0.02, length=3, width=2).shape  # rows and columns
    (100, 150)
    """

    spacing: Annotated[float, Number(1e-4, 10, "m", "of the cells")]
    length: Annotated[float, Number(1e-3, 1e4, "m", "of the grid along x")]
    width: Annotated[float, Number(1e-3, 1e4, "m", "of the grid along y")]
    x: Annotated[float, Number(-1e6, 1e6, "m", "middle of the grid")] = 0.0
    y: Annotated[float, Number(-1e6, 1e6, "m", "middle of the grid")] = 0.0
    repose: Annotated[
        float, Number(0.01, 1.5, "rad", "angle at which the ground slides by itself")
    ] = REPOSE

    def __post_init__(self):
        check_numbers(self)
        rows, columns = self.shape
        require(
            rows * columns <= MOST_CELLS,
            f"footprints have {rows * columns} cells, more than {MOST_CELLS}",
        )

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows, along y, and of columns, along x."""
        return max(1, round(self.width / self.spacing)), max(
            1, round(self.length / self.spacing)
        )

    @property
    def middles(self) -> tuple[np.ndarray, np.ndarray]:
        """Places x (C,) and y (R,) of the middles of the cells, m."""
        rows, columns = self.shape
        along = lambda count, middle: (
            middle + self.spacing * (np.arange(count) - (count - 1) / 2)
        )
        return along(columns, self.x), along(rows, self.y)

    @property
    def grid(self) -> np.ndarray:
        """Numbers that `remember` reads: the corner x and y, m, the spacing, m, the tangent of the angle of repose, and the
        time in which an excess slides, s."""
        x, y = self.middles
        half, time = self.spacing / 2, SLIDES * math.sqrt(2 * self.spacing / GRAVITY)
        return np.array(
            [x[0] - half, y[0] - half, self.spacing, math.tan(self.repose), time]
        )


class Prints(NamedTuple):
    """What footprints follow from. shape: rows and columns. geoms: number of geoms. grid: `Footprints.grid`, and a
    number that no other grid and number of geoms has. surface: (R, C),
    undisturbed heights, m. points: (P, 3), on the geoms in their frames, m. first: (G + 1,), first point of each geom."""

    shape: tuple[int, int]
    geoms: int
    grid: np.ndarray
    surface: np.ndarray
    points: np.ndarray
    first: np.ndarray

    @property
    def userdata_size(self) -> int:
        """How many numbers of userdata hold the memory."""
        return HEAD + PER_GEOM * self.geoms + PER_CELL * math.prod(self.shape)

    @property
    def cell_middles(self) -> tuple[np.ndarray, np.ndarray]:
        """Places x (C,) and y (R,) of the middles of the cells, m."""
        rows, columns = self.shape
        x_0, y_0, spacing = self.grid[:3]
        x = x_0 + spacing * (np.arange(columns) + 0.5)
        y = y_0 + spacing * (np.arange(rows) + 0.5)
        return x, y

    def memory(self, userdata: np.ndarray) -> Memory:
        """Return the memory in the userdata (N,) of a simulation."""
        return memory_of(
            userdata[len(userdata) - self.userdata_size :], self.geoms, *self.shape
        )


class Memory(NamedTuple):
    """What a simulation remembers, views of its userdata.

    head: the time, a number for each step, a height, m, that no ground is above, the box of cells that move: first
    row and end, first column and end, and the number of the grid that all this is of, the last of ``Prints.grid``.
    levels: (G,), mean height of the ground that each geom is in, m. carried: (G,), m, sum over cells of what each
    geom has pressed away and not heaped up yet. visits: (G,), a number for each time that a geom was in the ground,
    of no other geom. boxes: (G, 4), of cells under each geom. ground: (R, C), m. pressed: (R, C), m, how far geoms
    press the cells that they are in down, negative. marks: (R, C), the number of the last step in which a geom was in
    a cell. owners: (R, C), the visit in which a cell was heaped up last. floors: (R, C), m, its height before."""

    head: np.ndarray
    levels: np.ndarray
    carried: np.ndarray
    visits: np.ndarray
    boxes: np.ndarray
    ground: np.ndarray
    pressed: np.ndarray
    marks: np.ndarray
    owners: np.ndarray
    floors: np.ndarray


def memory_of(numbers, geoms, rows, columns) -> Memory:
    """Return the memory in an array of numbers, the last that userdata has."""
    cells, start = rows * columns, HEAD + PER_GEOM * geoms
    return Memory(
        numbers[:HEAD],
        numbers[HEAD : HEAD + geoms],
        numbers[HEAD + geoms : HEAD + 2 * geoms],
        numbers[HEAD + 2 * geoms : HEAD + 3 * geoms],
        numbers[HEAD + 3 * geoms : start].reshape(geoms, 4),
        numbers[start : start + cells].reshape(rows, columns),
        numbers[start + cells : start + 2 * cells].reshape(rows, columns),
        numbers[start + 2 * cells : start + 3 * cells].reshape(rows, columns),
        numbers[start + 3 * cells : start + 4 * cells].reshape(rows, columns),
        numbers[start + 4 * cells : start + 5 * cells].reshape(rows, columns),
    )


def begin_step(memory, time, form) -> float:
    """Return the time, s, since the last step that was remembered, at most 1 s; negative if there is nothing to do. At time 0,
    and where the memory is of another grid than that with the number ``form``, the ground is undisturbed."""
    passed = time - memory.head[TIME]
    if (time == 0.0 and passed != 0.0) or memory.head[
        FORM
    ] != form:  # a rollout leaves userdata as they are
        for numbers in (memory.levels, memory.carried, memory.visits):
            numbers[:] = 0.0
        for cells in (
            memory.boxes,
            memory.ground,
            memory.pressed,
            memory.marks,
            memory.owners,
            memory.floors,
        ):
            cells[:] = 0.0
        memory.head[:] = 0.0
        memory.head[FORM] = form
        passed = time
    if passed == 0.0:
        return -1.0
    memory.head[TIME] = time
    memory.head[STAMP] += 1.0
    if memory.head[STAMP] % EVERY == 0.0:
        memory.head[TOP] = max(memory.ground.max(), 0.0)
    return min(max(passed, 0.0), 1.0)


def remember(memory, time, prints, bodies, poses, slopes) -> None:
    """Take a step of all geoms, unless the memory has it already.

    prints: grid, (6,), undisturbed heights (R, C), points (P, 3) on the geoms and the first of each geom, (G + 1,). bodies:
    numbers (G, 4) of geoms, bodies and roots, and spheres (G, 4) as of `rft.mujoco.bed.Bed`. poses: arrays of
    `rft.mujoco.addresses.Arrays`. slopes: grid and frame of hills, (0, 0, 3) for none, and up and level."""
    grid, surface, points, first = prints
    numbers, spheres = bodies
    xpos, xmat, cvel, com = poses
    hills, frame, up, level = slopes
    passed = begin_step(memory, time, grid[5])
    if passed < 0.0:
        return
    for k in range(len(numbers)):
        turn, place = xmat[numbers[k, 0]], xpos[numbers[k, 0]]
        center, radius = spheres[k, :3], spheres[k, 3]
        x = (
            place[0]
            + turn[0, 0] * center[0]
            + turn[0, 1] * center[1]
            + turn[0, 2] * center[2]
        )
        y = (
            place[1]
            + turn[1, 0] * center[0]
            + turn[1, 1] * center[1]
            + turn[1, 2] * center[2]
        )
        z = (
            place[2]
            + turn[2, 0] * center[0]
            + turn[2, 1] * center[1]
            + turn[2, 2] * center[2]
        )
        if hills.shape[0] > 0:
            up, level = tangent_plane(hills, frame, x, y)
        memory.boxes[k] = 0.0
        if memory.visits[k] == 0.0:
            leave(memory, k)
        if (up[0] * x + up[1] * y + up[2] * z - level - radius) / up[2] < memory.head[
            TOP
        ]:
            press(
                memory, grid, k, points[first[k] : first[k + 1]], turn, place, up, level
            )
        else:
            memory.levels[k] = 0.0
            leave(memory, k)
    release(memory)
    for k in range(len(numbers)):
        geom, body, root = numbers[k, 0], numbers[k, 1], numbers[k, 2]
        r_x, r_y, r_z = (
            xpos[geom, 0] - com[root, 0],
            xpos[geom, 1] - com[root, 1],
            xpos[geom, 2] - com[root, 2],
        )
        v_x = cvel[body, 3] + cvel[body, 1] * r_z - cvel[body, 2] * r_y
        v_y = cvel[body, 4] + cvel[body, 2] * r_x - cvel[body, 0] * r_z
        v_z = cvel[body, 5] + cvel[body, 0] * r_y - cvel[body, 1] * r_x
        heap(memory, k, v_x, v_y, v_z)
    slide(memory, grid, surface, passed)


def press(memory, grid, k, points, turn, place, up, level) -> None:
    """Press the cells that geom k is in, and set its level. points: (P, 3), on its surface in its frame, m. The surface is
    undisturbed at up . x = level."""
    rows, columns = memory.ground.shape
    stamp, size, visit = memory.head[STAMP], grid[2], memory.visits[k]
    total, count, outside = 0.0, 0, 0
    bottom, least, beneath, top = 1e30, 1e30, 0.0, memory.head[TOP]
    height = (up[0] * place[0] + up[1] * place[1] + up[2] * place[2] - level) / up[2]
    u_x = (up[0] * turn[0, 0] + up[1] * turn[1, 0] + up[2] * turn[2, 0]) / up[2]
    u_y = (up[0] * turn[0, 1] + up[1] * turn[1, 1] + up[2] * turn[2, 1]) / up[2]
    u_z = (up[0] * turn[0, 2] + up[1] * turn[1, 2] + up[2] * turn[2, 2]) / up[2]
    for sweep in range(2):
        if sweep == 1 and (count == 0 or outside == 0):
            break
        for p in range(len(points)):
            a, b, c = points[p, 0], points[p, 1], points[p, 2]
            z = height + u_x * a + u_y * b + u_z * c
            if z >= top:
                outside += 1
                continue
            x = place[0] + turn[0, 0] * a + turn[0, 1] * b + turn[0, 2] * c
            y = place[1] + turn[1, 0] * a + turn[1, 1] * b + turn[1, 2] * c
            i, j = math.floor((y - grid[1]) / size), math.floor((x - grid[0]) / size)
            inside = 0 <= i < rows and 0 <= j < columns
            ground = memory.ground[i, j] if inside else 0.0
            if sweep == 0 and inside and memory.owners[i, j] == visit:
                ground = min(ground, memory.floors[i, j])
            above = z - ground
            if sweep == 0:
                bottom = min(bottom, z)
                if above < least:
                    least, beneath = above, ground
                if above < 0.0:
                    total += ground
                    count += 1
                else:
                    outside += 1
            elif inside and above < 0.0:
                if memory.marks[i, j] != stamp:
                    memory.marks[i, j] = stamp
                    extend(memory.boxes[k], i, j, 0, rows, columns)
                if above < memory.pressed[i, j]:
                    memory.carried[k] += memory.pressed[i, j] - above
                    memory.pressed[i, j] = above
    memory.levels[k] = total / count if count > 0 else min(beneath, bottom)
    if count == 0:
        leave(memory, k)


def leave(memory, k) -> None:
    """Let geom k be out of the ground: what it heaps up later it has not heaped up yet."""
    memory.visits[k] = memory.head[STAMP] * len(memory.visits) + k + 1.0


def extend(box, i, j, margin, rows, columns) -> None:
    """Let a box of cells hold a cell and its neighbours within a margin."""
    if box[1] <= box[0]:
        box[0], box[1], box[2], box[3] = rows, 0.0, columns, 0.0
    box[0], box[1] = (
        min(box[0], max(i - margin, 0)),
        max(box[1], min(i + margin + 1, rows)),
    )
    box[2], box[3] = (
        min(box[2], max(j - margin, 0)),
        max(box[3], min(j + margin + 1, columns)),
    )


def release(memory) -> None:
    """Lower the cells that geoms have left."""
    box, stamp = memory.head[BOX : BOX + 4], memory.head[STAMP]
    for i in range(int(box[0]), int(box[1])):
        for j in range(int(box[2]), int(box[3])):
            if memory.pressed[i, j] < 0.0 and memory.marks[i, j] != stamp:
                memory.ground[i, j] += memory.pressed[i, j]
                memory.pressed[i, j] = 0.0


def heap(memory, k, v_x, v_y, v_z) -> None:
    """Heap what geom k has pressed away on the cells around it. v_x, v_y, v_z: its velocity, m/s."""
    rows, columns = memory.ground.shape
    box, stamp = memory.boxes[k], memory.head[STAMP]
    if box[1] <= box[0]:
        return
    active = memory.head[BOX : BOX + 4]
    extend(active, int(box[0]), int(box[2]), RIM + 1, rows, columns)
    extend(active, int(box[1]) - 1, int(box[3]) - 1, RIM + 1, rows, columns)
    if memory.carried[k] == 0.0:
        return
    middle_i, middle_j, total = (
        0.5 * (box[0] + box[1] - 1.0),
        0.5 * (box[2] + box[3] - 1.0),
        0.0,
    )
    for sweep in range(2):
        if sweep == 1 and total == 0.0:
            return
        for i in range(max(int(box[0]) - RIM, 0), min(int(box[1]) + RIM, rows)):
            for j in range(max(int(box[2]) - RIM, 0), min(int(box[3]) + RIM, columns)):
                if memory.pressed[i, j] < 0.0 or not beside(memory.marks, stamp, i, j):
                    continue
                d_i, d_j = i - middle_i, j - middle_j
                ahead = (d_j * v_x + d_i * v_y) / max(
                    math.sqrt(d_i * d_i + d_j * d_j), 1e-9
                )
                weight = max(ahead, 0.0) + max(-v_z, 0.0) + 1e-9
                if sweep == 0:
                    total += weight
                else:
                    own(memory, i, j, memory.visits[k])
                    memory.ground[i, j] += memory.carried[k] * weight / total
                    memory.head[TOP] = max(memory.head[TOP], memory.ground[i, j])
    memory.carried[k] = 0.0


def own(memory, i, j, visit) -> None:
    """Let a cell be heaped up in a visit from now on."""
    if memory.owners[i, j] != visit:
        memory.owners[i, j], memory.floors[i, j] = visit, memory.ground[i, j]


def beside(marks, stamp, i, j) -> bool:
    """Return whether a geom is within `RIM` cells of a cell, and in the cell itself none."""
    rows, columns = marks.shape
    if marks[i, j] == stamp:
        return False
    for m in range(max(i - RIM, 0), min(i + RIM + 1, rows)):
        for n in range(max(j - RIM, 0), min(j + RIM + 1, columns)):
            if marks[m, n] == stamp:
                return True
    return False


def slide(memory, grid, surface, passed) -> None:
    """Let ground that is steeper than the angle of repose slide for a time, s. surface: (R, C), undisturbed heights, m."""
    rows, columns = memory.ground.shape
    ground, pressed, owners = memory.ground, memory.pressed, memory.owners
    share, order = min(SHARE, passed / grid[4]), memory.head[STAMP] % 4.0
    box = memory.head[BOX : BOX + 4]
    i_0, i_1, j_0, j_1 = int(box[0]), int(box[1]), int(box[2]), int(box[3])
    box[:] = 0.0
    for a in range(i_1 - i_0):
        i = i_1 - 1 - a if order % 2.0 == 1.0 else i_0 + a
        for b in range(j_1 - j_0):
            j = j_1 - 1 - b if order >= 2.0 else j_0 + b
            if pressed[i, j] < 0.0:
                extend(box, i, j, 1, rows, columns)
                continue
            for n in range(4):  # the neighbours ahead; those behind have this one ahead
                m, o = i + (n > 0), j + (1 if n < 2 else 2 - n)
                if m >= rows or o >= columns or o < 0 or pressed[m, o] < 0.0:
                    continue
                drop = surface[i, j] + ground[i, j] - surface[m, o] - ground[m, o]
                limit = grid[3] * grid[2] * (1.4142135623730951 if n % 2 == 1 else 1.0)
                excess = abs(drop) - limit
                if excess > STEEPER * limit:
                    moved = share * excess if drop > 0.0 else -share * excess
                    if drop > 0.0 and owners[i, j] > owners[m, o]:
                        own(memory, m, o, owners[i, j])
                    elif drop < 0.0 and owners[m, o] > owners[i, j]:
                        own(memory, i, j, owners[m, o])
                    ground[i, j] -= moved
                    ground[m, o] += moved
                    extend(box, i, j, 2, rows, columns)


COMPILED = (
    memory_of,
    remember,
    begin_step,
    press,
    leave,
    extend,
    release,
    heap,
    own,
    beside,
    slide,
)
