"""Ground that remembers: heights on a grid, which geoms press down and heap up, and
which slide at the angle of repose.

Heights are counted from the undisturbed surface. The memory of a simulation lies in the
``userdata`` of its MjData, all zeros for undisturbed ground, so that copies, resets and
batches of MuJoCo carry it along. Whenever the time has changed,

- points on the surface of each geom press the cells that they are in down to the
  deepest point. The cell is lowered once the geom has left it; until then the geom
  still sees the ground as it was;
- the volume that is pressed away is heaped on the cells around the geom, in all
  directions in proportion to its speed down, and ahead of it in proportion to its speed
  along (assumed);
- where the ground is steeper than the angle of repose, the excess slides to the
  neighbours, in a tenth of the time in which grains fall by one cell (assumed). Cells
  under geoms neither give nor take.

The force on a geom is that in level ground of the mean height of the cells where it is
in the ground. The heap that it has raised since it was last out of the ground does not
count: the stresses of the laws were measured with such a heap. Geoms wholly below the
ground press nothing: grains close behind them (assumed). Compiled code calls these
functions, too."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from rft.core.checks import Number, check_numbers
from rft.core.metres import GRAVITY
from rft.core.refusal import require
from rft.laws.catalogue import REPOSE
from rft.mujoco.ground.hills import tangent_plane

MAX_CELLS = 1_000_000
TOP_INTERVAL = 256.0  # steps between two searches for the highest ground
RIM = 2  # cells: how far around a geom its heap is raised at once, assumed
# Share of the excess of a slope that slides in one step at most; with a larger one,
# left and right differ more.
MAX_SHARE = 0.25
# Time in which an excess slides over that in which grains fall by one cell.
SLIDING_TIME = 0.1
STEEPER = 1e-3  # share by which a slope may exceed the angle of repose
DIAGONAL = 1.4142135623730951  # distance of diagonal neighbours over the spacing
HEAD, PER_GEOM, PER_CELL = 8, 7, 5  # numbers that a simulation remembers
TIME, STAMP, TOP, BOX, FORM = 0, 1, 2, 3, 7  # places in the head; the box takes four


@dataclass(frozen=True)
class Footprints:
    """Ground that remembers, on a grid of cells.

    spacing: of the cells, m. length, width: of the grid along x and y, m, around the
    place ``x``, ``y``; the ground beyond it remembers nothing. repose: rad; the default
    is that of `rft.terradynamics.ground.Slope`.

    Examples
    --------
    >>> from rft.mujoco import Footprints
    >>> Footprints(spacing=0.02, length=3, width=2).shape  # rows and columns
    (100, 150)
    """

    spacing: Annotated[float, Number(1e-4, 10, "m", "size of the cells")]
    length: Annotated[
        float, Number(1e-3, 1e4, "m", "number of cells of the grid along x")
    ]
    width: Annotated[
        float, Number(1e-3, 1e4, "m", "number of cells of the grid along y")
    ]
    x: Annotated[float, Number(-1e6, 1e6, "m", "x of the middle of the grid")] = 0.0
    y: Annotated[float, Number(-1e6, 1e6, "m", "y of the middle of the grid")] = 0.0
    repose: Annotated[
        float,
        Number(
            0.01, 1.5, "rad", "angle of repose, at which the ground slides by itself"
        ),
    ] = REPOSE

    def __post_init__(self):
        check_numbers(self)
        rows, columns = self.shape
        require(
            rows * columns <= MAX_CELLS,
            f"footprints would need {rows * columns} cells, more than {MAX_CELLS}",
        )

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows, along y, and of columns, along x."""
        rows = max(1, round(self.width / self.spacing))
        columns = max(1, round(self.length / self.spacing))
        return rows, columns

    @property
    def middles(self) -> tuple[np.ndarray, np.ndarray]:
        """Places x (C,) and y (R,) of the middles of the cells, m."""
        rows, columns = self.shape
        x = self.x + self.spacing * (np.arange(columns) - (columns - 1) / 2)
        y = self.y + self.spacing * (np.arange(rows) - (rows - 1) / 2)
        return x, y

    @property
    def grid(self) -> np.ndarray:
        """Numbers that `remember` reads: the corner x and y, m, the spacing, m, the
        tangent of the angle of repose, and the time in which an excess slides, s."""
        x, y = self.middles
        half = self.spacing / 2
        time = SLIDING_TIME * math.sqrt(2 * self.spacing / GRAVITY)
        return np.array(
            [x[0] - half, y[0] - half, self.spacing, math.tan(self.repose), time]
        )


class Prints(NamedTuple):
    """The grid of footprints over a bed, and the points of geoms that press the ground.

    shape: rows and columns. geoms: number of geoms. grid: `Footprints.grid`, and a
    number that no other grid and number of geoms has. surface: (R, C), undisturbed
    heights, m. points: (P, 3), on the geoms in their frames, m. first: (G + 1,), first
    point of each geom."""

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
    """The memory of a simulation, views of its userdata.

    head: the time; a number for each step, the stamp; a height, m, that no ground is
    above; the box of cells that move: first row and end, first column and end; and the
    number of the grid that the memory belongs to, the last of ``Prints.grid``. levels:
    (G,), mean height of the ground that each geom is in, m. carried: (G,), m, sum over
    cells of what each geom has pressed away and not heaped up yet. visits: (G,), a
    number for each time that a geom was in the ground, of no other geom. boxes: (G, 4),
    of cells under each geom. ground: (R, C), m. pressed: (R, C), m, how far geoms press
    the cells that they are in down, negative. marks: (R, C), the stamp of the last step
    in which a geom was in a cell. owners: (R, C), the visit in which a cell was heaped
    up last. floors: (R, C), m, its height before."""

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
    cells = rows * columns
    start = HEAD + PER_GEOM * geoms
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
    """Return the time, s, since the last step that was remembered, at most 1 s;
    negative if there is nothing to do.

    At time 0, and where the memory belongs to another grid than that with the number
    ``form``, the ground becomes undisturbed."""
    passed = time - memory.head[TIME]
    # A rollout begins anew at time 0, and leaves userdata as they are.
    begins_anew = time == 0.0 and passed != 0.0
    if begins_anew or memory.head[FORM] != form:
        clear(memory)
        memory.head[FORM] = form
        passed = time
    if passed == 0.0:
        return -1.0
    memory.head[TIME] = time
    memory.head[STAMP] += 1.0
    if memory.head[STAMP] % TOP_INTERVAL == 0.0:
        memory.head[TOP] = max(memory.ground.max(), 0.0)
    return min(max(passed, 0.0), 1.0)


def clear(memory) -> None:
    """Make the ground undisturbed."""
    memory.head[:] = 0.0
    memory.levels[:] = 0.0
    memory.carried[:] = 0.0
    memory.visits[:] = 0.0
    memory.boxes[:] = 0.0
    memory.ground[:] = 0.0
    memory.pressed[:] = 0.0
    memory.marks[:] = 0.0
    memory.owners[:] = 0.0
    memory.floors[:] = 0.0


def remember(memory, time, prints, bodies, poses, slopes) -> None:
    """Take a step of all geoms, unless the memory has it already.

    prints: grid, (6,), undisturbed heights (R, C), points (P, 3) on the geoms and the
    first of each geom, (G + 1,). bodies: numbers (G, 3) of geoms, bodies and roots, and
    spheres (G, 4) as of `rft.mujoco.bed.BedGeoms`. poses: arrays of
    `rft.mujoco.memory.addresses.Arrays`. slopes: grid and frame of hills, (0, 0, 3) for
    none, and up and level."""
    grid, surface, points, first = prints
    numbers, spheres = bodies
    xpos, xmat, cvel, com = poses
    hills, frame, up, level = slopes
    passed = begin_step(memory, time, grid[5])
    if passed < 0.0:
        return
    for k in range(len(numbers)):
        turn = xmat[numbers[k, 0]]
        place = xpos[numbers[k, 0]]
        x, y, z = to_world(turn, place, spheres[k])
        if hills.shape[0] > 0:
            up, level = tangent_plane(hills, frame, x, y)
        memory.boxes[k] = 0.0
        if memory.visits[k] == 0.0:
            begin_visit(memory, k)
        height = up[0] * x + up[1] * y + up[2] * z - level
        lowest = (height - spheres[k, 3]) / up[2]
        if lowest < memory.head[TOP]:
            own_points = points[first[k] : first[k + 1]]
            press(memory, grid, k, own_points, turn, place, up, level)
        else:
            memory.levels[k] = 0.0
            begin_visit(memory, k)
    lower_vacated_cells(memory)
    for k in range(len(numbers)):
        arm = xpos[numbers[k, 0]] - com[numbers[k, 2]]
        v_x, v_y, v_z = velocity_at(cvel[numbers[k, 1]], arm)
        heap(memory, k, v_x, v_y, v_z)
    slide(memory, grid, surface, passed)


def to_world(turn, place, point) -> tuple[float, float, float]:
    """Return the place x, y, z, m, in the world of a point in the frame of a geom."""
    a, b, c = point[0], point[1], point[2]
    x = place[0] + turn[0, 0] * a + turn[0, 1] * b + turn[0, 2] * c
    y = place[1] + turn[1, 0] * a + turn[1, 1] * b + turn[1, 2] * c
    z = place[2] + turn[2, 0] * a + turn[2, 1] * b + turn[2, 2] * c
    return x, y, z


def velocity_at(twist, arm) -> tuple[float, float, float]:
    """Return the velocity, m/s, at an arm (3,), m, from the point of a twist (6,),
    rotation first."""
    v_x = twist[3] + twist[1] * arm[2] - twist[2] * arm[1]
    v_y = twist[4] + twist[2] * arm[0] - twist[0] * arm[2]
    v_z = twist[5] + twist[0] * arm[1] - twist[1] * arm[0]
    return v_x, v_y, v_z


def press(memory, grid, k, points, turn, place, up, level) -> None:
    """Press the cells that geom k is in, and set its level.

    points: (P, 3), on its surface in its frame, m. The surface is undisturbed at up . x
    = level."""
    rows, columns = memory.ground.shape
    stamp = memory.head[STAMP]
    visit = memory.visits[k]
    top = memory.head[TOP]
    size = grid[2]
    total = 0.0
    count = 0
    outside = 0
    bottom = 1e30
    least = 1e30
    beneath = 0.0
    height = (up[0] * place[0] + up[1] * place[1] + up[2] * place[2] - level) / up[2]
    u_x = (up[0] * turn[0, 0] + up[1] * turn[1, 0] + up[2] * turn[2, 0]) / up[2]
    u_y = (up[0] * turn[0, 1] + up[1] * turn[1, 1] + up[2] * turn[2, 1]) / up[2]
    u_z = (up[0] * turn[0, 2] + up[1] * turn[1, 2] + up[2] * turn[2, 2]) / up[2]
    # The first sweep finds the level; the second presses, where the geom is partly in
    # the ground.
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
            i = math.floor((y - grid[1]) / size)
            j = math.floor((x - grid[0]) / size)
            inside = 0 <= i < rows and 0 <= j < columns
            ground = memory.ground[i, j] if inside else 0.0
            if sweep == 0 and inside and memory.owners[i, j] == visit:
                # Its own heap does not count.
                ground = min(ground, memory.floors[i, j])
            above = z - ground
            if sweep == 0:
                bottom = min(bottom, z)
                if above < least:
                    least = above
                    beneath = ground
                if above < 0.0:
                    total += ground
                    count += 1
                else:
                    outside += 1
            elif inside and above < 0.0:
                press_cell(memory, k, i, j, above, stamp)
    if count > 0:
        memory.levels[k] = total / count
    else:
        memory.levels[k] = min(beneath, bottom)
        begin_visit(memory, k)


def press_cell(memory, k, i, j, above, stamp) -> None:
    """Press a cell down to a point of geom k, which is ``above`` < 0, m, from its
    ground."""
    rows, columns = memory.ground.shape
    if memory.marks[i, j] != stamp:
        memory.marks[i, j] = stamp
        extend_box(memory.boxes[k], i, j, 0, rows, columns)
    if above < memory.pressed[i, j]:
        memory.carried[k] += memory.pressed[i, j] - above
        memory.pressed[i, j] = above


def begin_visit(memory, k) -> None:
    """Give geom k, which is out of the ground, the number of its next visit: earlier
    heaps are no longer its own."""
    memory.visits[k] = memory.head[STAMP] * len(memory.visits) + k + 1.0


def extend_box(box, i, j, margin, rows, columns) -> None:
    """Extend a box of cells to a cell and its neighbours within a margin."""
    if box[1] <= box[0]:
        box[0] = rows
        box[1] = 0.0
        box[2] = columns
        box[3] = 0.0
    box[0] = min(box[0], max(i - margin, 0))
    box[1] = max(box[1], min(i + margin + 1, rows))
    box[2] = min(box[2], max(j - margin, 0))
    box[3] = max(box[3], min(j + margin + 1, columns))


def lower_vacated_cells(memory) -> None:
    """Lower the cells that geoms have left."""
    box = memory.head[BOX : BOX + 4]
    stamp = memory.head[STAMP]
    for i in range(int(box[0]), int(box[1])):
        for j in range(int(box[2]), int(box[3])):
            if memory.pressed[i, j] < 0.0 and memory.marks[i, j] != stamp:
                memory.ground[i, j] += memory.pressed[i, j]
                memory.pressed[i, j] = 0.0


def heap(memory, k, v_x, v_y, v_z) -> None:
    """Heap what geom k has pressed away on the cells around it. v_x, v_y, v_z: its
    velocity, m/s."""
    rows, columns = memory.ground.shape
    box = memory.boxes[k]
    stamp = memory.head[STAMP]
    if box[1] <= box[0]:
        return
    active = memory.head[BOX : BOX + 4]
    extend_box(active, int(box[0]), int(box[2]), RIM + 1, rows, columns)
    extend_box(active, int(box[1]) - 1, int(box[3]) - 1, RIM + 1, rows, columns)
    if memory.carried[k] == 0.0:
        return
    middle_i = 0.5 * (box[0] + box[1] - 1.0)
    middle_j = 0.5 * (box[2] + box[3] - 1.0)
    total = 0.0
    # The first sweep sums the weights of the cells, the second heaps.
    for sweep in range(2):
        if sweep == 1 and total == 0.0:
            return
        for i in range(max(int(box[0]) - RIM, 0), min(int(box[1]) + RIM, rows)):
            for j in range(max(int(box[2]) - RIM, 0), min(int(box[3]) + RIM, columns)):
                if memory.pressed[i, j] < 0.0:
                    continue
                if not near_rim(memory.marks, stamp, i, j):
                    continue
                d_i = i - middle_i
                d_j = j - middle_j
                distance = max(math.sqrt(d_i * d_i + d_j * d_j), 1e-9)
                speed_towards = (d_j * v_x + d_i * v_y) / distance
                weight = max(speed_towards, 0.0) + max(-v_z, 0.0) + 1e-9
                if sweep == 0:
                    total += weight
                else:
                    set_owner(memory, i, j, memory.visits[k])
                    memory.ground[i, j] += memory.carried[k] * weight / total
                    memory.head[TOP] = max(memory.head[TOP], memory.ground[i, j])
    memory.carried[k] = 0.0


def set_owner(memory, i, j, visit) -> None:
    """Note that a cell is heaped up in a visit from now on."""
    if memory.owners[i, j] != visit:
        memory.owners[i, j] = visit
        memory.floors[i, j] = memory.ground[i, j]


def near_rim(marks, stamp, i, j) -> bool:
    """Return whether a geom is within `RIM` cells of a cell, and none in the cell
    itself."""
    rows, columns = marks.shape
    if marks[i, j] == stamp:
        return False
    for m in range(max(i - RIM, 0), min(i + RIM + 1, rows)):
        for n in range(max(j - RIM, 0), min(j + RIM + 1, columns)):
            if marks[m, n] == stamp:
                return True
    return False


def slide(memory, grid, surface, passed) -> None:
    """Let ground that is steeper than the angle of repose slide for a time, s. surface:
    (R, C), undisturbed heights, m."""
    rows, columns = memory.ground.shape
    ground = memory.ground
    pressed = memory.pressed
    share = min(MAX_SHARE, passed / grid[4])
    order = memory.head[STAMP] % 4.0
    box = memory.head[BOX : BOX + 4]
    i_0, i_1, j_0, j_1 = int(box[0]), int(box[1]), int(box[2]), int(box[3])
    box[:] = 0.0
    for a in range(i_1 - i_0):
        # Steps take turns in the order of cells, so that no direction is preferred.
        i = i_1 - 1 - a if order % 2.0 == 1.0 else i_0 + a
        for b in range(j_1 - j_0):
            j = j_1 - 1 - b if order >= 2.0 else j_0 + b
            if pressed[i, j] < 0.0:
                extend_box(box, i, j, 1, rows, columns)
                continue
            # The four neighbours ahead; those behind have this one ahead.
            for n in range(4):
                m = i if n == 0 else i + 1
                o = j + 1 if n < 2 else j + 2 - n
                if m >= rows or o >= columns or o < 0 or pressed[m, o] < 0.0:
                    continue
                drop = surface[i, j] + ground[i, j] - surface[m, o] - ground[m, o]
                limit = grid[3] * grid[2] * (DIAGONAL if n % 2 == 1 else 1.0)
                excess = abs(drop) - limit
                if excess > STEEPER * limit:
                    volume = share * excess if drop > 0.0 else -share * excess
                    shift_ground(memory, i, j, m, o, volume)
                    extend_box(box, i, j, 2, rows, columns)


def shift_ground(memory, i, j, m, o, volume) -> None:
    """Move ground from the cell (i, j) to its neighbour (m, o), or back where the
    volume, m, over the area of a cell, is negative."""
    owners = memory.owners
    # The cell that receives ground belongs to the later visit.
    if volume > 0.0 and owners[i, j] > owners[m, o]:
        set_owner(memory, m, o, owners[i, j])
    elif volume < 0.0 and owners[m, o] > owners[i, j]:
        set_owner(memory, i, j, owners[m, o])
    memory.ground[i, j] -= volume
    memory.ground[m, o] += volume


COMPILED = (
    memory_of,
    remember,
    begin_step,
    clear,
    to_world,
    velocity_at,
    press,
    press_cell,
    begin_visit,
    extend_box,
    lower_vacated_cells,
    heap,
    set_owner,
    near_rim,
    slide,
    shift_ground,
)
