"""Shells of a mesh: its connected surfaces, which of them close, and which lie inside others.

An edge is sound if triangles run along it as often one way as the other. Two bodies may
so share an edge, with four triangles.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rft.core.refusal import Refusal, require

NEARLY = 0.1  # of its surface: area of the caps of a mesh that nearly closes; assumed
MOST_SHELLS = 3000
CLEARANCE = 1e-6  # of the size: shells that are closer touch
PAIRS_AT_ONCE = 4_000_000  # pairs of boxes, for memory
FINEST_GRID = 256  # cells along a side
# A turn about an oblique axis: no ray then meets edges of meshes that lie along axes.
GENERIC_TURN = np.array([
    [0.4541523277849393, -0.4101242125625566, -0.7909132654327299],
    [-0.27991497606173854, 0.7771067359128687, -0.5636955979739449],
    [0.8458092393346607, 0.4773921357425044, 0.23812492391039797],
])  # fmt: skip


def directed_edges(faces: np.ndarray) -> np.ndarray:
    """Return the edges (3 F, 2) of triangles (F, 3), each in the sense it is run."""
    return np.stack([faces, faces[:, [1, 2, 0]]], -1).reshape(-1, 2)


def edge_codes(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return one whole number (3 F,) for each edge, whichever way it is run, and whether
    it is run from the lower vertex to the higher."""
    count = int(faces.max(initial=-1)) + 1
    a, b = directed_edges(faces).T
    return np.minimum(a, b) * count + np.maximum(a, b), a < b


def excess(faces: np.ndarray) -> np.ndarray:
    """Return the edges (E, 2) that are run more often this way than the other.

    An edge occurs as often as it lacks a triangle on its other side.
    """
    count = int(faces.max(initial=-1)) + 1
    codes, forward = edge_codes(faces)
    unique, index = np.unique(codes, return_inverse=True)
    sense = np.where(forward, 1, -1)
    surplus = np.bincount(index.reshape(-1), sense, len(unique)).astype(int)
    ends = np.stack([unique // count, unique % count], -1)
    ends[surplus < 0] = ends[surplus < 0, ::-1]
    return np.repeat(ends, np.abs(surplus), axis=0)


def neighbours(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return pairs (P, 2) of triangles across edges that two share, and whether both
    run along theirs the same way (P,)."""
    codes, forward = edge_codes(faces)
    order = np.argsort(codes, kind="stable")
    starts = np.flatnonzero(np.diff(codes[order], prepend=-1))
    uses = np.diff(starts, append=len(order))
    first = order[starts[uses == 2]]
    second = order[starts[uses == 2] + 1]
    return np.stack([first, second], -1) // 3, forward[first] == forward[second]


def shells(faces: np.ndarray) -> list[np.ndarray]:
    """Return the shells of a mesh, as numbers of triangles.

    Triangles belong together across edges that two share. Where more meet at an edge,
    surfaces that close by themselves are shells; the others there belong together.
    """
    piece = pieces(faces)
    if piece.max() == 0:
        return [np.arange(len(faces))]
    members = _members(piece)
    is_open = np.array([len(excess(faces[member])) > 0 for member in members])
    codes, _ = edge_codes(faces)
    owner = np.repeat(piece, 3)
    loose = is_open[owner]
    order = np.argsort(codes[loose], kind="stable")
    same = np.diff(codes[loose][order]) == 0
    owners = owner[loose][order]
    joined = np.stack([owners[:-1][same], owners[1:][same]], -1)
    return _members(_grouped(len(members), joined)[piece])


def pieces(faces: np.ndarray) -> np.ndarray:
    """Return the number (F,) of each triangle's piece, which edges of more than two
    triangles bound."""
    return _grouped(len(faces), neighbours(faces)[0])


def _grouped(count: int, pairs: np.ndarray) -> np.ndarray:
    """Return the number (count,) of the connected part of each node of a graph."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(pairs)), tuple(pairs.T)), (count, count))
    return connected_components(graph, directed=False)[1]


def _members(label: np.ndarray) -> list[np.ndarray]:
    """Return the indices that have each label 0, 1, ..."""
    order = np.argsort(label, kind="stable")
    return np.split(order, np.cumsum(np.bincount(label))[:-1])


def oriented(faces: np.ndarray) -> np.ndarray | None:
    """Return which triangles (F,) to turn so that neighbours agree on which side is
    out, the fewest of each shell; None if that is impossible."""
    pairs, is_against = neighbours(faces)
    count = len(faces)
    # Two nodes stand for each triangle, as it is and turned.
    crossed = is_against * count
    links = np.concatenate([
        np.stack([pairs[:, 0], pairs[:, 1] + crossed], -1),
        np.stack([pairs[:, 0] + count, pairs[:, 1] + count - crossed], -1),
    ])  # fmt: skip
    label = _grouped(2 * count, links)
    as_is, turned = label[:count], label[count:]
    if (as_is == turned).any():
        return None
    n_as_is = np.bincount(as_is, minlength=label.max() + 1)
    kept, other = n_as_is[as_is], n_as_is[turned]
    return (kept < other) | ((kept == other) & (as_is > turned))


def volume(corners: np.ndarray) -> float:
    """Return the volume that closed triangles (F, 3, 3) enclose, m^3."""
    a, b, c = np.moveaxis(corners - corners[0, 0], 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


def area(corners: np.ndarray) -> float:
    """Return the area of triangles (F, 3, 3), m^2."""
    a, b, c = np.moveaxis(corners, 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=-1).sum() / 2)


LONGEST_LOOP = 60  # edges of a hole that gets its least surface; the cost is cubic


def caps(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Return vertices and triangles (C, 3) that close the holes of a mesh, and the
    number of holes. Large holes take a new vertex in their middle."""
    loops = _loops(excess(faces)[:, ::-1])
    points = list(vertices)
    out: list[tuple[int, int, int]] = []
    for loop in loops:
        if len(loop) > LONGEST_LOOP:
            middle = vertices[loop].mean(0)
            out += [(a, b, len(points)) for a, b in zip(loop, [*loop[1:], loop[0]])]
            points.append(middle)
        else:
            out += [(loop[i], loop[j], loop[k]) for i, j, k in _least(vertices[loop])]
    return np.array(points), np.array(out, int).reshape(-1, 3), len(loops)


def _loops(edges: np.ndarray) -> list[list[int]]:
    """Return loops of vertices, without repetition, that run along directed edges."""
    ahead: dict[int, list[int]] = {}
    for a, b in edges.tolist():
        ahead.setdefault(a, []).append(b)
    loops = []
    for start in list(ahead):
        while ahead[start]:
            path = [start]
            while ahead[path[-1]]:
                vertex = ahead[path[-1]].pop()
                if vertex in path:
                    first = path.index(vertex)
                    loops.append(path[first:])
                    del path[first + 1 :]
                else:
                    path.append(vertex)
    return loops


def _least(points: np.ndarray) -> list[tuple[int, int, int]]:
    """Return triangles of least total area that span a loop of points (N, 3).

    least[i, j] is that of the part of the loop from i to j (dynamic programming).
    """
    count = len(points)
    least = np.zeros((count, count))
    choice = np.zeros((count, count), int)
    for span in range(2, count):
        for i in range(count - span):
            j = i + span
            middle = np.arange(i + 1, j)
            normal = np.cross(points[middle] - points[i], points[j] - points[i])
            sizes = np.linalg.norm(normal, axis=-1)
            costs = least[i, middle] + least[middle, j] + sizes
            best = int(costs.argmin())
            choice[i, j] = middle[best]
            least[i, j] = costs[best]
    out, parts = [], [(0, count - 1)]
    while parts:
        i, j = parts.pop()
        if j - i > 1:
            k = int(choice[i, j])
            out.append((i, k, j))
            parts += [(i, k), (k, j)]
    return out


def nearly_closes(vertices: np.ndarray, faces: np.ndarray) -> bool:
    """Return whether caps of at most `NEARLY` of an open surface would close it."""
    points, added, _ = caps(vertices, faces)
    return area(points[added]) <= NEARLY * area(vertices[faces])


def without_walls(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return a closed shell (F, 3) without its pieces that have the body on both sides;
    Refusal if one has it in part."""
    piece = pieces(faces)
    if piece.max() == 0:
        return faces
    corners = vertices[faces]
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=-1)
    normal /= np.maximum(size, np.finfo(float).tiny)[:, None]
    gap = CLEARANCE * float(np.ptp(corners, axis=(0, 1)).max())
    sense = np.sign(volume(corners))
    is_wall = winding(corners.mean(1) + sense * gap * normal, corners) != 0
    is_wall &= size > 1e-14 * size.max()
    hidden = np.bincount(piece, is_wall * size)
    share = hidden / np.bincount(piece, size)
    if ((share > 0.01) & (share < 0.99)).any():
        raise _crossing()
    return faces[share[piece] < 0.5]


def is_enclosed(vertices: np.ndarray, parts: list[np.ndarray]) -> np.ndarray:
    """Return which of some closed shells, each as triangles (F_k, 3), lie inside
    others; Refusal if two cross or touch."""
    count = len(parts)
    require(
        count <= MOST_SHELLS,
        f"the mesh has {count:,} closed shells, more than {MOST_SHELLS:,}",
        instead="give one body",
    )
    inside = np.zeros(count, bool)
    if count == 1:
        return inside
    corners = [vertices[part] for part in parts]
    lows = np.array([c.min((0, 1)) for c in corners])
    highs = np.array([c.max((0, 1)) for c in corners])
    gap = CLEARANCE * (highs.max(0) - lows.min(0)).max()
    meet = np.ones((count, count), bool)
    for axis in range(3):
        meet &= lows[:, None, axis] - gap <= highs[None, :, axis] + gap
    meet &= meet.T
    for one, two in np.argwhere(np.triu(meet, 1)):
        low = np.maximum(lows[one], lows[two]) - gap
        high = np.minimum(highs[one], highs[two]) + gap
        near = [_within(corners[k], low, high) for k in (one, two)]
        if _cross(near[0], near[1], gap) or _cross(near[1], near[0], gap):
            raise _crossing()
        inside[one] |= _is_inside(corners[one], corners[two], gap)
        inside[two] |= _is_inside(corners[two], corners[one], gap)
    return inside


def _crossing() -> Refusal:
    return Refusal(
        "parts of the mesh cross or touch",
        because="grains do not touch the faces of one that lie in another",
        instead="unite them (Boolean union) in the program that made the mesh",
    )


def _within(corners: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the triangles whose boxes meet a box."""
    meets = (corners.min(1) <= high).all(-1) & (corners.max(1) >= low).all(-1)
    return corners[meets]


def _is_inside(corners: np.ndarray, others: np.ndarray, gap: float) -> bool:
    """Return whether a closed shell lies inside another; Refusal if only in part."""
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=-1)
    flat = size <= 1e-14 * size.max()
    out = normal[~flat] / size[~flat, None] * np.sign(volume(corners))
    points = corners[~flat].mean(1) + gap * out
    low, high = others.min((0, 1)), others.max((0, 1))
    near = ((points >= low) & (points <= high)).all(-1)
    found = np.zeros(len(points), bool)
    if near.any():
        found[near] = winding(points[near], others) != 0
    if found.any() and not found.all():
        raise _crossing()
    return bool(found.all())


def winding(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return how often closed triangles (F, 3, 3) wind round points (N, 3), 1 inside a
    body: the signed number of triangles above each."""
    origin = corners[0, 0]
    points = (points - origin) @ GENERIC_TURN
    corners = (corners - origin) @ GENERIC_TURN
    flat = points[:, :2]
    number = np.zeros(len(points), int)
    for p, t in _meeting(flat, flat, corners[..., :2].min(1), corners[..., :2].max(1)):
        relative = corners[t] - points[p, None]
        x, y = relative[..., 0], relative[..., 1]
        # Each edge is taken in one sense, so that neighbours agree on which has a point.
        sides = np.stack([_side(x, y, 0, 1), _side(x, y, 1, 2), _side(x, y, 2, 0)], -1)
        hit = (sides > 0).all(-1) | (sides < 0).all(-1)
        sides, relative, p = sides[hit], relative[hit], p[hit]
        weight = sides[:, [1, 2, 0]]
        height = (weight * relative[..., 2]).sum(-1) / weight.sum(-1)
        above = height > 0
        np.add.at(number, p[above], np.sign(sides[above, 0]).astype(int))
    return number


def _side(x: np.ndarray, y: np.ndarray, i: int, j: int) -> np.ndarray:
    """Return the cross product of corners i and j, with the exact opposite sign for the
    same edge in the other sense."""
    swap = (x[:, i] > x[:, j]) | ((x[:, i] == x[:, j]) & (y[:, i] > y[:, j]))
    a = np.where(swap, x[:, j], x[:, i]), np.where(swap, y[:, j], y[:, i])
    b = np.where(swap, x[:, i], x[:, j]), np.where(swap, y[:, i], y[:, j])
    return np.where(swap, -1.0, 1.0) * (a[0] * b[1] - a[1] * b[0])


def _cross(corners: np.ndarray, others: np.ndarray, gap: float) -> bool:
    """Return whether an edge of triangles (F, 3, 3) pierces other triangles."""
    if not (len(corners) and len(others)):
        return False
    turned = (corners - others[0, 0]) @ GENERIC_TURN
    others = (others - others[0, 0]) @ GENERIC_TURN
    start = turned.reshape(-1, 3)
    end = np.roll(turned, -1, 1).reshape(-1, 3)
    once = start[:, 0] < end[:, 0]  # of the two triangles of an edge
    start, end = start[once], end[once]
    a, b, c = np.moveaxis(others, 1, 0)
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=-1)
    unit = normal / np.maximum(size, np.finfo(float).tiny)[:, None]
    low, high = np.minimum(start, end), np.maximum(start, end)
    for e, t in _meeting(low, high, others.min(1), others.max(1)):
        one = ((start[e] - a[t]) * unit[t]).sum(-1)
        two = ((end[e] - a[t]) * unit[t]).sum(-1)
        through = (one * two < 0) & (np.minimum(np.abs(one), np.abs(two)) > gap)
        e, t, one, two = e[through], t[through], one[through], two[through]
        share = one / (one - two)
        point = start[e] + share[:, None] * (end[e] - start[e])
        depths = [
            (np.cross(q - p, point - p) * unit[t]).sum(-1)
            / np.linalg.norm(q - p, axis=-1)
            for p, q in ((a[t], b[t]), (b[t], c[t]), (c[t], a[t]))
        ]
        if (np.min(depths, axis=0) > gap).any():
            return True
    return False


def _meeting(
    low: np.ndarray, high: np.ndarray, low_b: np.ndarray, high_b: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield pairs of boxes that meet, as indices into the first and the second boxes.

    Boxes (N, 2 or more) are sorted into a grid along their first two axes. Pairs of
    which both lie in several cells occur several times.
    """
    origin = np.minimum(low[:, :2].min(0), low_b[:, :2].min(0))
    extent = np.maximum(high[:, :2].max(0), high_b[:, :2].max(0)) - origin
    cells = int(np.clip(np.sqrt(len(low_b)), 1, FINEST_GRID))
    while True:
        scale = cells / np.maximum(extent, np.finfo(float).tiny)
        spans = [
            _span((x[:, :2] - origin) * scale, cells)
            for x in (low, high, low_b, high_b)
        ]
        filled = np.prod(spans[3] - spans[2] + 1, axis=1).sum()
        crowded = np.prod(spans[1] - spans[0] + 1, axis=1).sum()
        if cells == 1 or filled + crowded < 20 * (len(low) + len(low_b)) + 1_000_000:
            break
        cells //= 2
    index, cell = _filled(spans[0], spans[1], cells)
    index_b, cell_b = _filled(spans[2], spans[3], cells)
    order = np.argsort(cell_b, kind="stable")
    index_b, cell_b = index_b[order], cell_b[order]
    first = np.searchsorted(cell_b, cell, "left")
    count = np.searchsorted(cell_b, cell, "right") - first
    total = np.cumsum(count)
    begin = 0
    while begin < len(index):
        done = total[begin - 1] if begin else 0
        end = max(begin + 1, int(np.searchsorted(total, done + PAIRS_AT_ONCE)))
        some = slice(begin, end)
        one = np.repeat(index[some], count[some])
        nth = np.arange(len(one)) - np.repeat(
            total[some] - count[some] - done, count[some]
        )
        two = index_b[np.repeat(first[some], count[some]) + nth]
        meets = ((low[one] <= high_b[two]) & (high[one] >= low_b[two])).all(-1)
        yield one[meets], two[meets]
        begin = end


def _span(places: np.ndarray, cells: int) -> np.ndarray:
    return np.clip(np.floor(places), 0, cells - 1).astype(int)


def _filled(first: np.ndarray, last: np.ndarray, cells: int):
    """Return (number of the box, number of the cell) of all cells that boxes cover."""
    width = last - first + 1
    count = width.prod(1)
    index = np.repeat(np.arange(len(count)), count)
    nth = np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)
    x = first[index, 0] + nth // width[index, 1]
    y = first[index, 1] + nth % width[index, 1]
    return index, x * cells + y
