"""Shells of a mesh: its connected surfaces, which of them close, and which lie inside
others.

An edge is sound if as many triangles run along it one way as the other. Two bodies may
therefore share an edge, at which four triangles meet.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rft.core.refusal import Refusal, require

# Area of the caps that close a mesh, over the area of the mesh, up to which it nearly
# closes; assumed.
NEARLY = 0.1
LONGEST_LOOP = 60  # edges of a hole that gets its least surface; the cost is cubic
MOST_SHELLS = 3000
CLEARANCE = 1e-6  # of the size: shells that are closer touch
PAIRS_AT_ONCE = 4_000_000  # pairs of boxes, for memory
FINEST_GRID = 256  # cells along a side
# A rotation about an oblique axis, after which no ray along an axis meets edges of
# meshes that lay along axes.
OBLIQUE_ROTATION = np.array([
    [0.4541523277849393, -0.4101242125625566, -0.7909132654327299],
    [-0.27991497606173854, 0.7771067359128687, -0.5636955979739449],
    [0.8458092393346607, 0.4773921357425044, 0.23812492391039797],
])  # fmt: skip


def directed_edges(faces: np.ndarray) -> np.ndarray:
    """Return the edges (3 F, 2) of triangles (F, 3), each as (start, end) in the sense
    in which its triangle runs along it."""
    return np.stack([faces, faces[:, [1, 2, 0]]], -1).reshape(-1, 2)


def edge_codes(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return one whole number (3 F,) for each edge, in whichever sense a triangle runs
    along it, and whether that is from the lower vertex to the higher."""
    count = int(faces.max(initial=-1)) + 1
    a, b = directed_edges(faces).T
    return np.minimum(a, b) * count + np.maximum(a, b), a < b


def excess_edges(faces: np.ndarray) -> np.ndarray:
    """Return the edges (E, 2) along which more triangles run this way than the other.

    An edge is repeated as often as it lacks a triangle on its other side.
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
    """Return the pairs (P, 2) of triangles that meet at an edge, where no others do,
    and whether both run along the edge the same way (P,)."""
    codes, forward = edge_codes(faces)
    order = np.argsort(codes, kind="stable")
    starts = np.flatnonzero(np.diff(codes[order], prepend=-1))
    uses = np.diff(starts, append=len(order))
    first = order[starts[uses == 2]]
    second = order[starts[uses == 2] + 1]
    return np.stack([first, second], -1) // 3, forward[first] == forward[second]


def shells(faces: np.ndarray) -> list[np.ndarray]:
    """Return the shells of a mesh, as indices of triangles.

    Triangles belong together across edges at which no others meet. Where more than two
    meet at an edge, surfaces that close by themselves are shells; the other surfaces
    there belong together.
    """
    piece = pieces(faces)
    if piece.max() == 0:
        return [np.arange(len(faces))]
    members = _members(piece)
    is_open = np.array([len(excess_edges(faces[member])) > 0 for member in members])

    # Join the open pieces that have an edge in common.
    codes, _ = edge_codes(faces)
    piece_of_edge = np.repeat(piece, 3)
    is_loose = is_open[piece_of_edge]
    order = np.argsort(codes[is_loose], kind="stable")
    is_same = np.diff(codes[is_loose][order]) == 0
    owners = piece_of_edge[is_loose][order]
    joined = np.stack([owners[:-1][is_same], owners[1:][is_same]], -1)
    return _members(_component_labels(len(members), joined)[piece])


def pieces(faces: np.ndarray) -> np.ndarray:
    """Return the number (F,) of each triangle's piece; pieces are connected surfaces
    that end at edges of more than two triangles."""
    return _component_labels(len(faces), neighbours(faces)[0])


def _component_labels(count: int, pairs: np.ndarray) -> np.ndarray:
    """Return the number (count,) of the connected part of each node of a graph, from
    the pairs (P, 2) of nodes that are linked."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(pairs)), tuple(pairs.T)), (count, count))
    return connected_components(graph, directed=False)[1]


def _members(label: np.ndarray) -> list[np.ndarray]:
    """Return the indices that have each label 0, 1, ..."""
    order = np.argsort(label, kind="stable")
    return np.split(order, np.cumsum(np.bincount(label))[:-1])


def reversed_triangles(faces: np.ndarray) -> np.ndarray | None:
    """Return which triangles (F,) to reverse so that neighbours agree on which side is
    out, the fewest of each shell; None if that is impossible."""
    pairs, runs_same_way = neighbours(faces)
    count = len(faces)

    # Two nodes stand for each triangle: k as it is, k + count reversed.
    shift = runs_same_way * count
    one = pairs[:, 0]
    two = pairs[:, 1]
    links = [
        np.stack([one, two + shift], -1),
        np.stack([one + count, two + count - shift], -1),
    ]
    label = _component_labels(2 * count, np.concatenate(links))
    label_as_is = label[:count]
    label_reversed = label[count:]
    if (label_as_is == label_reversed).any():
        return None

    n_as_is = np.bincount(label_as_is, minlength=label.max() + 1)
    n_kept = n_as_is[label_as_is]
    n_other = n_as_is[label_reversed]
    is_tie = n_kept == n_other
    return (n_kept < n_other) | (is_tie & (label_as_is > label_reversed))


def volume(corners: np.ndarray) -> float:
    """Return the volume that closed triangles (F, 3, 3) enclose, m^3."""
    a, b, c = np.moveaxis(corners - corners[0, 0], 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


def area(corners: np.ndarray) -> float:
    """Return the area of triangles (F, 3, 3), m^2."""
    a, b, c = np.moveaxis(corners, 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=-1).sum() / 2)


def caps(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Return vertices and triangles (C, 3) that close the holes of a mesh, and the
    number of holes. Large holes take a new vertex in their middle."""
    loops = _loops(excess_edges(faces)[:, ::-1])
    points = list(vertices)
    triangles: list[tuple[int, int, int]] = []
    for loop in loops:
        if len(loop) > LONGEST_LOOP:
            middle = len(points)
            points.append(vertices[loop].mean(0))
            following = [*loop[1:], loop[0]]
            triangles += [(a, b, middle) for a, b in zip(loop, following)]
        else:
            surface = _least_surface(vertices[loop])
            triangles += [(loop[i], loop[j], loop[k]) for i, j, k in surface]
    return np.array(points), np.array(triangles, int).reshape(-1, 3), len(loops)


def _loops(edges: np.ndarray) -> list[list[int]]:
    """Return loops of vertices, each vertex once, that run along directed edges
    (E, 2)."""
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


def _least_surface(points: np.ndarray) -> list[tuple[int, int, int]]:
    """Return triangles of least total area that span a loop of points (N, 3), by
    dynamic programming.

    least[i, j] is twice that area for the part of the loop from i to j, and choice[i,
    j] the third corner of the triangle at the line from i to j.
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

    triangles = []
    parts = [(0, count - 1)]
    while parts:
        i, j = parts.pop()
        if j - i > 1:
            k = int(choice[i, j])
            triangles.append((i, k, j))
            parts += [(i, k), (k, j)]
    return triangles


def nearly_closes(vertices: np.ndarray, faces: np.ndarray) -> bool:
    """Return whether caps of at most `NEARLY` of an open surface would close it."""
    points, added, _ = caps(vertices, faces)
    return area(points[added]) <= NEARLY * area(vertices[faces])


def without_walls(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the triangles (F, 3) of a closed shell without its pieces that have the
    body on both sides; Refusal if a piece has it there in part."""
    piece = pieces(faces)
    if piece.max() == 0:
        return faces
    corners = vertices[faces]
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=-1)
    normal /= np.maximum(size, np.finfo(float).tiny)[:, None]

    # A triangle is part of a wall if points just outside it lie in the body.
    gap = CLEARANCE * float(np.ptp(corners, axis=(0, 1)).max())
    sense = np.sign(volume(corners))
    is_wall = winding(corners.mean(1) + sense * gap * normal, corners) != 0
    is_wall &= size > 1e-14 * size.max()
    hidden = np.bincount(piece, is_wall * size)
    share = hidden / np.bincount(piece, size)
    if ((share > 0.01) & (share < 0.99)).any():
        raise _crossing_refusal()
    return faces[share[piece] < 0.5]


def is_enclosed(vertices: np.ndarray, parts: list[np.ndarray]) -> np.ndarray:
    """Return which closed shells (K,), each given as triangles (F_k, 3), lie inside
    others; Refusal if two cross or touch."""
    count = len(parts)
    require(
        count <= MOST_SHELLS,
        f"the mesh has {count:,} closed shells, more than {MOST_SHELLS:,}",
        instead="give a single body",
    )
    inside = np.zeros(count, bool)
    if count == 1:
        return inside

    # Pairs of shells whose boxes meet.
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
        near_one = _triangles_in_box(corners[one], low, high)
        near_two = _triangles_in_box(corners[two], low, high)
        if _pierces(near_one, near_two, gap) or _pierces(near_two, near_one, gap):
            raise _crossing_refusal()
        inside[one] |= _is_inside(corners[one], corners[two], gap)
        inside[two] |= _is_inside(corners[two], corners[one], gap)
    return inside


def _crossing_refusal() -> Refusal:
    return Refusal(
        "parts of the mesh intersect or touch",
        because="grains do not touch faces inside another part",
        instead="unite them (Boolean union) in the program that created the mesh",
    )


def _triangles_in_box(
    corners: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Return the triangles (K, 3, 3) whose bounding boxes meet a box."""
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

    low = others.min((0, 1))
    high = others.max((0, 1))
    is_near = ((points >= low) & (points <= high)).all(-1)
    is_inside = np.zeros(len(points), bool)
    if is_near.any():
        is_inside[is_near] = winding(points[is_near], others) != 0
    if is_inside.any() and not is_inside.all():
        raise _crossing_refusal()
    return bool(is_inside.all())


def winding(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return how often closed triangles (F, 3, 3) wind round points (N, 3): the signed
    number of triangles above each, 1 inside a body and 0 outside."""
    origin = corners[0, 0]
    points = (points - origin) @ OBLIQUE_ROTATION
    corners = (corners - origin) @ OBLIQUE_ROTATION
    flat = points[:, :2]
    low = corners[..., :2].min(1)
    high = corners[..., :2].max(1)
    number = np.zeros(len(points), int)
    for p, t in _meeting_boxes(flat, flat, low, high):
        relative = corners[t] - points[p, None]
        x = relative[..., 0]
        y = relative[..., 1]
        # Each edge is taken in one sense, so that neighbours agree on which has a
        # point.
        sides = np.stack([_side(x, y, 0, 1), _side(x, y, 1, 2), _side(x, y, 2, 0)], -1)
        hit = (sides > 0).all(-1) | (sides < 0).all(-1)
        sides = sides[hit]
        relative = relative[hit]
        p = p[hit]

        # Where the ray upwards meets the triangle, by barycentric coordinates.
        weight = sides[:, [1, 2, 0]]
        height = (weight * relative[..., 2]).sum(-1) / weight.sum(-1)
        is_above = height > 0
        np.add.at(number, p[is_above], np.sign(sides[is_above, 0]).astype(int))
    return number


def _side(x: np.ndarray, y: np.ndarray, i: int, j: int) -> np.ndarray:
    """Return the cross products (K,) of corners i and j, at x and y (K, 3), with
    exactly the opposite sign for the same edge in the other sense."""
    x_i = x[:, i]
    y_i = y[:, i]
    x_j = x[:, j]
    y_j = y[:, j]
    is_reversed = (x_i > x_j) | ((x_i == x_j) & (y_i > y_j))
    x_a = np.where(is_reversed, x_j, x_i)
    y_a = np.where(is_reversed, y_j, y_i)
    x_b = np.where(is_reversed, x_i, x_j)
    y_b = np.where(is_reversed, y_i, y_j)
    return np.where(is_reversed, -1.0, 1.0) * (x_a * y_b - y_a * x_b)


def _pierces(corners: np.ndarray, others: np.ndarray, gap: float) -> bool:
    """Return whether an edge of triangles (F, 3, 3) pierces other triangles by more
    than a gap, m."""
    if not (len(corners) and len(others)):
        return False
    origin = others[0, 0]
    corners = (corners - origin) @ OBLIQUE_ROTATION
    others = (others - origin) @ OBLIQUE_ROTATION
    start = corners.reshape(-1, 3)
    end = np.roll(corners, -1, 1).reshape(-1, 3)
    is_first = start[:, 0] < end[:, 0]  # of the two triangles of an edge
    start = start[is_first]
    end = end[is_first]

    a, b, c = np.moveaxis(others, 1, 0)
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=-1)
    unit = normal / np.maximum(size, np.finfo(float).tiny)[:, None]
    low = np.minimum(start, end)
    high = np.maximum(start, end)
    for e, t in _meeting_boxes(low, high, others.min(1), others.max(1)):
        # Distances of the ends from the plane of the triangle.
        one = ((start[e] - a[t]) * unit[t]).sum(-1)
        two = ((end[e] - a[t]) * unit[t]).sum(-1)
        through = (one * two < 0) & (np.minimum(np.abs(one), np.abs(two)) > gap)
        e = e[through]
        t = t[through]
        share = one[through] / (one[through] - two[through])
        point = start[e] + share[:, None] * (end[e] - start[e])

        # Distances of the point in the plane from the edges, positive inside.
        depths = []
        for p, q in ((a[t], b[t]), (b[t], c[t]), (c[t], a[t])):
            turn = (np.cross(q - p, point - p) * unit[t]).sum(-1)
            depths.append(turn / np.linalg.norm(q - p, axis=-1))
        if (np.min(depths, axis=0) > gap).any():
            return True
    return False


def _meeting_boxes(
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
        # A grid in which boxes cover many cells is made coarser.
        scale = cells / np.maximum(extent, np.finfo(float).tiny)
        first = _cell_numbers((low[:, :2] - origin) * scale, cells)
        last = _cell_numbers((high[:, :2] - origin) * scale, cells)
        first_b = _cell_numbers((low_b[:, :2] - origin) * scale, cells)
        last_b = _cell_numbers((high_b[:, :2] - origin) * scale, cells)
        covered = np.prod(last - first + 1, axis=1).sum()
        covered_b = np.prod(last_b - first_b + 1, axis=1).sum()
        n_boxes = len(low) + len(low_b)
        if cells == 1 or covered + covered_b < 20 * n_boxes + 1_000_000:
            break
        cells //= 2

    index, cell = _covered_cells(first, last, cells)
    index_b, cell_b = _covered_cells(first_b, last_b, cells)
    order = np.argsort(cell_b, kind="stable")
    index_b = index_b[order]
    cell_b = cell_b[order]

    # Each entry of index meets those of index_b from ``start`` on, ``count`` of them.
    start = np.searchsorted(cell_b, cell, "left")
    count = np.searchsorted(cell_b, cell, "right") - start
    total = np.cumsum(count)
    begin = 0
    while begin < len(index):
        n_before = total[begin - 1] if begin else 0
        end = int(np.searchsorted(total, n_before + PAIRS_AT_ONCE))
        end = max(begin + 1, end)
        chunk = slice(begin, end)
        one = np.repeat(index[chunk], count[chunk])
        n_earlier = np.repeat(total[chunk] - count[chunk] - n_before, count[chunk])
        nth = np.arange(len(one)) - n_earlier
        two = index_b[np.repeat(start[chunk], count[chunk]) + nth]
        meets = ((low[one] <= high_b[two]) & (high[one] >= low_b[two])).all(-1)
        yield one[meets], two[meets]
        begin = end


def _cell_numbers(places: np.ndarray, cells: int) -> np.ndarray:
    return np.clip(np.floor(places), 0, cells - 1).astype(int)


def _covered_cells(
    first: np.ndarray, last: np.ndarray, cells: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return (number of the box, number of the cell) of all cells that boxes cover,
    from the first and the last cell (N, 2) of each box along both axes."""
    width = last - first + 1
    count = width.prod(1)
    index = np.repeat(np.arange(len(count)), count)
    nth = np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)
    x = first[index, 0] + nth // width[index, 1]
    y = first[index, 1] + nth % width[index, 1]
    return index, x * cells + y
