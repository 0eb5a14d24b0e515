"""Experiments: a body that moves in a settled bed, computed in blocks between files, so
that a stopped one goes on.

Every block begins from a restart file, in a run that nobody stops as well: a resumed
run has the same digits."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rft.core.checks import in_range, is_number
from rft.core.metres import GRAVITY
from rft.core.refusal import Refusal, require
from rft.grains.bed import Bed
from rft.grains.contacts import contacts, motion_energy
from rft.grains.engine import Engine, Forces, write_data
from rft.grains.motions import Motion
from rft.grains.spheres import Spheres

try:
    import fcntl
# no such locks on Windows, where a run in one folder by two processes is not refused
except ImportError:
    fcntl = None  # type: ignore[assignment]

# of the files and of all constants that digits depend on; another number begins anew
FORMAT = 2
BLOCK = 2000  # steps between restart files: some 15 s of a bed of 15,000 grains
FREE = 2.0  # grain diameters that must lie below a body and beside it
COVER = 1.0  # grain diameters that must lie above it
FASTEST = (
    0.01  # grain diameters a step: a body that moves farther passes through contacts
)
SETTLING = 0.4, 0.3  # s of falling in a viscous air, and of rest without it
SLOWING = 0.6  # s in which the viscous air slows a grain down
# kinetic energy of a settled grain, on average, over its weight times its diameter
CALM = 1e-3
LONGEST = 5.0  # s of settling
Progress = Callable[[float], None]
# the series of a run over a block, its state and time, and the digest of the file after
# it
Block = dict[str, np.ndarray]


def _silent(fraction: float) -> None: ...


class Run(NamedTuple):
    """What happened to a body, over n samples in time.

    t: (n,), end of each sample, s. force: (n, 3), mean force of the grains on the body,
    N. moment: (n,), about its centre of mass, N m. profile: (n, spheres, 3), force on
    each sphere, N. along: (spheres,), where it is on the body (`Spheres.along`), m.
    pose: (n, 3), x and y, m, and heading, rad, of its frame, at t. centre: (n, 2), of
    mass, m. alpha: (n, joints), rad. work: (n,), of the body on the grains so far, J.
    kinetic: (n,), energy of the body, J. energy: (blocks + 1, 2), of the grains, J, at
    the start and after each block: kinetic with gravity, and elastic. overlaps:
    (blocks + 1, 2), largest and mean, in grain diameters. facts: grains, spheres,
    packing, surface (m, over the floor), time_step (s), steps, mass (kg), processor
    seconds, and the version of LAMMPS.

    Examples
    --------
    >>> from rft.grains import Run
    >>> Run._fields[:4]
    ('t', 'force', 'moment', 'profile')
    """

    t: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    profile: np.ndarray
    along: np.ndarray
    pose: np.ndarray
    centre: np.ndarray
    alpha: np.ndarray
    work: np.ndarray
    kinetic: np.ndarray
    energy: np.ndarray
    overlaps: np.ndarray
    facts: dict[str, float]


SERIES = (
    "t",
    "force",
    "moment",
    "profile",
    "pose",
    "centre",
    "alpha",
    "work",
    "kinetic",
    "energy",
    "overlaps",
)


@dataclass(frozen=True)
class Experiment:
    """A body that moves in a bed.

    bed, body, motion: what they are. duration (s). depth (m): of the body's axis below
    the surface, half of the bed's if None. sample (s): over which forces are averaged.

    `run` computes it, in a folder of the caller's. There the settled bed is kept, under
    a name by its content, for all motions of the body, and the run, block by block. The
    same experiment computed again is read from there; on one processor core it has the
    same digits.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.grains import Bed, Experiment, Tow, rod
    >>> experiment = Experiment(Bed(), rod(0.162, 6e-3), Tow(0.1, np.pi / 2), duration=0.4)
    >>> experiment.check()
    >>> experiment.n_steps, f"{experiment.grain_steps:.0e}"  # some 2e6 grain steps take a second
    (4080, '7e+07')
    """

    bed: Bed
    body: Spheres
    motion: Motion
    duration: float
    depth: float | None = None
    sample: float = 2e-3

    @property
    def height(self) -> float:
        """Height of the body's axis over the floor, m."""
        return self.bed.depth - (
            self.bed.depth / 2 if self.depth is None else self.depth
        )

    @property
    def n_steps(self) -> int:
        """Number of time steps, a multiple of those of a sample."""
        return self.sample_steps * max(
            1, round(self.duration / (self.sample_steps * self.bed.step))
        )

    @property
    def sample_steps(self) -> int:
        return max(1, round(self.sample / self.bed.step))

    @property
    def grain_steps(self) -> float:
        """Grains times steps, which the cost is proportional to; the settling of the
        bed is not counted."""
        return float(self.n_steps) * (self.bed.grains + len(self.body.radius))

    def steps_left(self, folder: str | Path) -> int:
        """Return the number of time steps that are not in a folder yet."""
        lengths = self._blocks()
        place = Path(folder) / f"run-{self._key()}"
        return sum(lengths[len(_blocks_done(place, len(lengths))) :])

    def is_settled(self, folder: str | Path) -> bool:
        """Return whether a folder has the bed at rest."""
        return _bed_file(
            Path(folder), _settled_key(self.bed, self.body, self.height)
        ).exists()

    def check(self) -> None:
        """Raise ValueError, one line, for a body that does not fit its bed, or a motion
        that it cannot do."""
        bed = self.bed
        body = self.body
        if self.depth is not None:
            in_range("depth", self.depth, 0, bed.depth, unit="m")
        in_range("duration", self.duration, bed.step, 1e6, unit="s")
        in_range("sample", self.sample, 1e-9, self.duration, unit="s")
        below = self.height + body.bottom
        above = bed.depth - self.height - body.top
        require(
            below >= FREE * bed.diameter and above >= COVER * bed.diameter,
            f"the bed is too shallow: {1e3 * below:.1f} mm below the body and {1e3 * above:.1f} mm above",
            because=f"{FREE:g} grains must fit in below and {COVER:g} above",
            instead="take a deeper bed or a thinner body",
        )
        room = FREE * bed.diameter + body.half_width
        if body.through:
            require(
                not bed.walled,
                "a bar spans a bed that is periodic",
                instead="take one without walls",
            )
            require(
                math.isclose(body.size, bed.length, rel_tol=1e-6),
                f"a bar of {body.size:g} m must be as long as its bed, {bed.length:g} m",
            )
        narrow = bed.width if body.through else min(bed.length, bed.width)
        reach = 2 * body.half_width if body.through else body.size
        require(
            narrow - reach >= 2 * room,
            f"the bed is too small: {1e3 * narrow:.0f} mm for a body that reaches {1e3 * reach:.0f} mm",
            because="it meets the walls" if bed.walled else "it meets its own image",
            instead=f"take a bed {1e3 * (reach + 2 * room):.0f} mm wide or more",
        )
        self.motion.check(body)

    def run(
        self,
        folder: str | Path,
        progress: Progress | None = None,
        film: float | None = None,
    ) -> Run:
        """Return the run, computed in a folder as far as it is not there.

        progress: called with the fraction done, of all time steps. film (s): between
        frames of text files there, ``frames-*.lammpstrj``, which OVITO opens as one;
        only of blocks that are computed now. Raises ValueError if grains fly off or the
        body leaves the bed: blocks that are done stay."""
        self.check()
        if film is not None:
            in_range("film", film, 1e-9, 1e6, unit="s")
        folder = Path(folder).resolve()
        report = progress or _silent
        settling = (
            0 if self.is_settled(folder) else round(sum(SETTLING) / self.bed.step)
        )
        share = settling / (settling + self.n_steps)
        settled = settle(
            self.bed, self.body, self.height, folder, lambda done: report(share * done)
        )
        place = folder / f"run-{self._key()}"
        lengths = self._blocks()
        place.mkdir(parents=True, exist_ok=True)
        blocks = _blocks_done(place, len(lengths))
        if len(blocks) < len(lengths):
            with _locked(place):
                for k in range(len(blocks), len(lengths)):
                    start = _state_file(place, k) if k else settled.file
                    step = sum(lengths[:k])
                    before = blocks[-1] if k else None
                    tell = lambda done: report(share + (1 - share) * done)
                    blocks.append(
                        _Block(
                            self, settled.bulk, place, k, step, before, tell
                        ).compute(start, lengths[k], film)
                    )
                _remove(_state_file(place, k) for k in range(1, len(lengths) + 1))
        return self._gathered(blocks, settled)

    def _blocks(self) -> list[int]:
        """Return the numbers of steps of the blocks."""
        most = self.sample_steps * max(1, BLOCK // self.sample_steps)
        whole, rest = divmod(self.n_steps, most)
        return [most] * whole + [rest] * (rest > 0)

    def _key(self) -> str:
        named = (
            self.motion.named(),
            self.duration,
            self.sample,
            _settled_key(self.bed, self.body, self.height),
        )
        return hashlib.sha256(
            json.dumps([FORMAT, *named], default=float).encode()
        ).hexdigest()[:16]

    def _gathered(self, blocks: list[Block], settled: Settled) -> Run:
        series = {name: np.concatenate([b[name] for b in blocks]) for name in SERIES}
        facts = {
            **settled.facts, "time_step": self.bed.step, "steps": self.n_steps, "mass": self.body.mass(settled.bulk),
            "cpu": float(sum(b["cpu"] for b in blocks)),
        }  # fmt: skip
        return Run(**series, along=self.body.along, facts=facts)


class _Block:
    """One block of an experiment under way: what LAMMPS calls every step, and the
    samples of it."""

    def __init__(
        self, experiment: Experiment, bulk: float, place: Path, index: int, step: int, before: Block | None,
        progress: Progress,
    ):  # fmt: skip
        self.experiment = experiment
        self.place = place
        self.index = index
        self.progress = progress
        self.step = step
        self.dt = experiment.bed.step
        self.n = experiment.sample_steps
        self.mass = experiment.body.mass(bulk)
        self.rows: dict[str, list] = {name: [] for name in SERIES}
        self.state = experiment.motion.start()
        self.work = 0.0
        if before:
            self.state = before["state"]
            self.work = float(before["work"][-1])
        self.now = self._move(0.0)
        self._clear()

    def _move(self, dt: float) -> Any:
        e = self.experiment
        self.state, moved = e.motion.move(
            self.state, self.step * self.dt, dt, e.body, self.mass, e.height
        )
        return moved

    def _clear(self) -> None:
        self.sums = np.zeros(3), 0.0, np.zeros((len(self.experiment.body.radius), 3))

    def compute(self, start: Path, steps: int, film: float | None) -> Block:
        """Compute the block, write its rows and the state after it, and return the
        rows."""
        e = self.experiment
        clock = time.process_time()
        with Engine(e.bed, start, len(e.body.radius), restart=True) as engine:
            if not self.index:
                self._weigh(engine)
            if film:
                engine.film(
                    self.place / f"frames-{self.index:04d}-*.lammpstrj",
                    max(1, round(film / self.dt)),
                )
            engine.steps(steps, self._place)
            self._weigh(engine)
            with _replacing(_state_file(self.place, self.index + 1)) as path:
                engine.write(path)
        after = _digest(_state_file(self.place, self.index + 1))
        series = {
            name: np.array(rows, np.float32 if name == "profile" else float)
            for name, rows in self.rows.items()
        }
        with (
            _replacing(_rows_file(self.place, self.index)) as path,
            path.open("wb") as file,
        ):
            np.savez_compressed(
                file,
                **series,
                state=self.state,
                cpu=time.process_time() - clock,
                after=after,
            )
        _remove([_state_file(self.place, self.index)] if self.index else [])
        return _rows(self.place, self.index)

    def _place(self, forces: Forces) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Take up the forces of a step and return the body of the next."""
        on, twist = forces
        was = self.now
        p = self.now.placement
        arm = p.centres[:, :2] - [was.centre.real, was.centre.imag]
        force = on.sum(0)
        moment = float(
            (arm[:, 0] * on[:, 1] - arm[:, 1] * on[:, 0]).sum() + twist[:, 2].sum()
        )
        require(
            bool(np.isfinite(force).all()),
            "grains fly off",
            instead="take a smaller time step",
        )
        power = float((on * p.velocities).sum() + twist[:, 2] @ p.rates)
        self.work -= power * self.dt
        total, turning, each = self.sums
        self.sums = total + force, turning + moment, each + on
        self.state = self.experiment.motion.push(self.state, force, moment, self.dt)
        self.step += 1
        self.now = self._move(self.dt)
        self._check(p.centres)
        if self.step % self.n == 0:
            self._sample()
        return self.now.placement

    def _check(self, before: np.ndarray) -> None:
        bed = self.experiment.bed
        centres = self.now.placement.centres
        far = np.abs(centres - before).max()
        require(
            bool(far <= FASTEST * bed.diameter),
            f"at {self.step * self.dt:.3f} s the body moves {far / bed.diameter:.3f} grains a step",
            because=f"contacts are resolved up to {FASTEST:g}",
            instead="move it more slowly",
        )
        if bed.walled:
            edge = (
                np.array([bed.length, bed.width]) / 2
                - self.experiment.body.half_width
                - bed.diameter
            )
            require(
                bool((np.abs(centres[:, :2]) <= edge).all()),
                f"at {self.step * self.dt:.3f} s the body leaves the bed",
                instead="take a larger one",
            )

    def _sample(self) -> None:
        e, now, (force, moment, each) = self.experiment, self.now, self.sums
        values = {
            "t": self.step * self.dt, "force": force / self.n, "moment": moment / self.n, "profile": each / self.n,
            "pose": now.pose, "centre": (now.centre.real, now.centre.imag), "alpha": now.alpha, "work": self.work,
            "kinetic": now.kinetic,
        }  # fmt: skip
        for name, value in values.items():
            self.rows[name].append(value)
        self._clear()
        self.progress(self.step / e.n_steps)

    def _weigh(self, engine: Engine) -> None:
        particles = engine.particles()
        touching = contacts(self.experiment.bed, particles)
        self.rows["energy"].append(
            (motion_energy(self.experiment.bed, particles), touching.elastic)
        )
        self.rows["overlaps"].append((touching.largest, touching.mean))


class Settled(NamedTuple):
    """A bed at rest around a body. file: a restart file of LAMMPS. facts: numbers of
    it. bulk: density of the packed grains, kg/m^3."""

    file: Path
    facts: dict[str, float]
    bulk: float


def settle(
    bed: Bed,
    body: Spheres,
    height: float,
    folder: str | Path,
    progress: Progress = lambda fraction: None,
) -> Settled:
    """Return the bed at rest around a straight body whose axis is at a height (m) over
    the floor, from the folder where it is there, else computed and kept there.
    progress: called with the fraction done."""
    folder = Path(folder).resolve()
    plain = str(folder).isascii() and '"' not in str(folder)
    require(
        plain,
        f"LAMMPS takes no folder named {folder}",
        instead="take one of ASCII letters, without quotes",
    )
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Refusal(
            f"cannot keep beds in {folder}",
            because=error.strerror,
            instead="take another folder",
        ) from None
    file = _bed_file(folder, _settled_key(bed, body, height))
    sheet = file.with_suffix(".json")
    facts = _known_facts(file, sheet)
    if facts is not None:
        return Settled(file, facts, facts["packing"] * bed.density)
    if sheet.exists():
        with contextlib.suppress(OSError):
            os.replace(file, file.with_suffix(".damaged"))
    clock = time.process_time()
    zero = np.zeros(body.joints)
    links = body.links(zero, zero)
    middle = body.half_lengths @ links.centres / body.half_lengths.sum()
    centres = body.placed(links, -middle, 0.0, 0.0, 0.0, height).centres
    data = file.with_suffix(f".{os.getpid()}.data")
    try:
        write_data(data, bed, centres, body.radius)
        with Engine(
            bed, data, len(body.radius), restart=False, friction=bed.settling_friction
        ) as engine:
            facts = _settle(engine, bed, body, progress)
            facts["settling_cpu"] = time.process_time() - clock
            with _replacing(file) as path:
                engine.write(path)
    finally:
        data.unlink(missing_ok=True)
    with _replacing(sheet) as path:
        path.write_text(
            json.dumps(
                {
                    "facts": facts,
                    "sha256": hashlib.sha256(file.read_bytes()).hexdigest(),
                    "sha256_of_facts": _digest_of(facts),
                }
            )
            + "\n"
        )
    return Settled(file, facts, facts["packing"] * bed.density)


def _known_facts(file: Path, sheet: Path) -> dict[str, float] | None:
    """Return the facts of a bed that is kept; None if it is not, or damaged."""
    try:
        known = json.loads(sheet.read_text())
        facts = known["facts"]
        digest_of_facts = _digest_of(facts)
        # sheets of older versions have none of the facts
        is_whole = known.get("sha256_of_facts", digest_of_facts) == digest_of_facts
        is_whole = is_whole and file.exists() and known["sha256"] == _digest(file)
        return facts if is_whole and is_number(facts["packing"]) else None
    except (
        OSError,
        ValueError,
        LookupError,
        TypeError,
        AttributeError,
        RecursionError,
    ):
        return None


def _digest_of(facts: dict[str, float]) -> str:
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


def _settle(
    engine: Engine, bed: Bed, body: Spheres, progress: Progress
) -> dict[str, float]:
    """Let a bed come to rest; return its facts."""
    falling, resting = (max(1, round(t / bed.step)) for t in SETTLING)
    watch = lambda step: progress(min(1.0, step / (falling + resting)))
    engine.settle(falling, bed.weight / GRAVITY / SLOWING, watch)
    engine.settle(resting, watch=watch)
    calm = CALM * bed.weight * bed.diameter
    while (kinetic := _kinetic(engine, bed)) > calm:
        require(
            engine.now * bed.step < LONGEST,
            f"the bed does not settle within {LONGEST:g} s: {kinetic / calm:.1f} times the energy of one at rest",
            instead="take more friction or less restitution",
        )
        engine.settle(resting, watch=watch)
    p = engine.particles()
    z = p.x[~p.body, 2]
    volume = 4 / 3 * np.pi * p.radius[~p.body] ** 3
    surface = float(np.quantile(z, 0.98)) + bed.diameter / 2
    # Beside the body, and two grains from floor and surface; a grain counts where its
    # centre lies.
    low = 2 * bed.diameter
    high = surface - 2 * bed.diameter
    margin = body.half_width + bed.diameter
    inside = (z > low) & (z < high) & (np.abs(p.x[~p.body, 1]) > margin)
    packing = float(
        volume[inside].sum() / (bed.length * (bed.width - 2 * margin) * (high - low))
    )
    return {
        "grains": len(z), "spheres": len(body.radius), "packing": packing, "surface": surface,
        "lammps": int(engine.lmp.version()),
    }  # fmt: skip


def _kinetic(engine: Engine, bed: Bed) -> float:
    """Return the mean kinetic energy of a grain, without its spin, J."""
    p = engine.particles()
    return float(np.mean((p.v[~p.body] ** 2).sum(1))) * bed.weight / GRAVITY / 2


def _settled_key(bed: Bed, body: Spheres, height: float) -> str:
    arrays = [
        a.round(12).tolist() for a in (body.link.astype(float), body.at, body.radius)
    ]
    named = [
        FORMAT,
        astuple(bed),
        arrays,
        body.half_lengths.round(12).tolist(),
        body.density,
        height,
    ]
    return hashlib.sha256(json.dumps(named).encode()).hexdigest()[:16]


def _bed_file(folder: Path, key: str) -> Path:
    return folder / f"bed-{key}.restart"


def _rows_file(place: Path, block: int) -> Path:
    return place / f"block-{block:04d}.npz"


def _state_file(place: Path, block: int) -> Path:
    """Return the restart file that a block begins from."""
    return place / f"before-{block:04d}.restart"


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.exists() else ""


def _rows(place: Path, block: int) -> Block:
    """Return the rows of a block; {} if they are not there, or damaged."""
    try:
        with _rows_file(place, block).open("rb") as file, np.load(file) as rows:
            found = {name: rows[name] for name in rows.files}
    except Exception:  # of NumPy, zipfile and zlib, which have many for a damaged file
        return {}
    return found if {*found} == {*SERIES, "state", "cpu", "after"} else {}


def _blocks_done(place: Path, n: int) -> list[Block]:
    """Return the blocks whose rows are there and whole, with the state to go on from,
    or all n of them."""
    blocks: list[Block] = []
    while len(blocks) < n and (rows := _rows(place, len(blocks))):
        blocks.append(rows)
    while 0 < len(blocks) < n and str(blocks[-1].get("after", "none")) != _digest(
        _state_file(place, len(blocks))
    ):
        blocks.pop()
    return blocks


def _remove(paths: Any) -> None:
    for path in paths:
        path.unlink(missing_ok=True)


@contextlib.contextmanager
def _replacing(path: Path) -> Iterator[Path]:
    """Yield a name to write to; the file takes the place of ``path`` once it is
    whole."""
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


@contextlib.contextmanager
def _locked(place: Path) -> Iterator[None]:
    """Refuse a run that another process computes."""
    with (place / "lock").open("w") as file:
        if fcntl:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                what = f"another process computes the run in {place}"
                raise Refusal(
                    what, instead="wait for it, or take another folder"
                ) from None
        yield
