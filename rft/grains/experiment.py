"""Experiments: a body that moves in a settled bed, computed in blocks between files, so
that an interrupted run can be resumed.

Every block begins from a restart file, in an uninterrupted run as well: a resumed run
has the same digits."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rft.core.checks import in_range, is_number
from rft.core.metres import GRAVITY
from rft.core.refusal import Refusal, require
from rft.grains.bed import Bed
from rft.grains.contacts import Particles, contacts, motion_energy
from rft.grains.engine import Engine, Forces, write_data
from rft.grains.motions import BodyState, Motion
from rft.grains.spheres import Placement, Spheres

try:
    import fcntl
except ImportError:
    # Windows has no such locks: a run in one folder by two processes is not refused.
    fcntl = None  # type: ignore[assignment]

# Version of the files and of all constants that digits depend on; runs of another
# version are computed anew.
FORMAT = 2
# Steps between restart files: some 15 s of computing for a bed of 15,000 grains.
BLOCK = 2000
# Grain diameters that must lie below a body and beside it, and above it.
CLEARANCE = 2.0
COVER = 1.0
# Grain diameters per step: a body that moves farther passes through contacts.
LARGEST_MOVE = 0.01
# s of falling in a viscous air, and of rest without it.
SETTLING_TIMES = (0.4, 0.3)
SLOWING_TIME = 0.6  # s in which the viscous air slows a grain down
# Mean kinetic energy of a settled grain, over its weight times its diameter.
CALM = 1e-3
LONGEST_SETTLING = 5.0  # s
# Quantile of the grains' heights, which the surface of a bed is taken from.
SURFACE_QUANTILE = 0.98
Progress = Callable[[float], None]
# Series of a run over a block, its state and time, and the digest of the file after it.
Block = dict[str, np.ndarray]


def _no_progress(fraction: float) -> None:
    """Ignore the finished fraction."""


class Run(NamedTuple):
    """Result of an experiment: forces on a body and its motion, over n samples in time.

    t: (n,), end of each sample, s. force: (n, 3), mean force of the grains on the body,
    N. moment: (n,), about its centre of mass, N m. profile: (n, spheres, 3), force on
    each sphere, N. arc_length: (spheres,), place of each sphere on the body, m, as of
    `Spheres.arc_length`. pose: (n, 3), x and y, m, and heading, rad, of its frame, at
    t. centre: (n, 2), of mass, m. alpha: (n, joints), rad. work: (n,), of the body on
    the grains so far, J. kinetic: (n,), energy of the body, J. energy: (blocks + 1, 2),
    of the grains, J, at the start and after each block: kinetic with gravity, and
    elastic. overlaps: (blocks + 1, 2), largest and mean, in grain diameters. facts:
    grains, spheres, packing, surface (m, over the floor), time_step (s), steps, mass
    (kg), cpu (processor seconds), and lammps (its version).

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
    arc_length: np.ndarray
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

    duration (s). depth (m): of the body's axis below the surface, half of the bed's if
    None. sample (s): over which forces are averaged.

    `run` computes it, in a folder of the caller's. The folder keeps the settled bed,
    under a name by its content, for all motions of the body, and the run, block by
    block. The same experiment computed again is read from there; on one processor core
    it has the same digits.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.grains import Bed, Experiment, Tow, rod
    >>> tow = Tow(0.1, np.pi / 2)
    >>> experiment = Experiment(Bed(), rod(0.162, 6e-3), tow, duration=0.4)
    >>> experiment.check()
    >>> # some 2e6 grain steps take a second
    >>> experiment.n_steps, f"{experiment.grain_steps:.0e}"
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
        depth = self.bed.depth / 2 if self.depth is None else self.depth
        return self.bed.depth - depth

    @property
    def n_steps(self) -> int:
        """Number of time steps, a multiple of those of a sample."""
        samples = round(self.duration / (self.sample_steps * self.bed.step))
        return self.sample_steps * max(1, samples)

    @property
    def sample_steps(self) -> int:
        """Number of time steps of a sample."""
        return max(1, round(self.sample / self.bed.step))

    @property
    def grain_steps(self) -> float:
        """Grains times steps, which the cost is proportional to, without the settling
        of the bed."""
        return float(self.n_steps) * (self.bed.grains + len(self.body.radius))

    def steps_left(self, folder: str | Path) -> int:
        """Return the number of time steps that a folder does not have yet."""
        lengths = self._block_lengths()
        done = _stored_blocks(self._run_folder(Path(folder)), len(lengths))
        return sum(lengths[len(done) :])

    def is_settled(self, folder: str | Path) -> bool:
        """Return whether a folder has the bed at rest."""
        key = _settled_key(self.bed, self.body, self.height)
        return _bed_file(Path(folder), key).exists()

    def check(self) -> None:
        """Raise ValueError, one line, for a body that does not fit its bed, or a motion
        that it cannot do."""
        bed = self.bed
        if self.depth is not None:
            in_range("depth", self.depth, 0, bed.depth, unit="m")
        in_range("duration", self.duration, bed.step, 1e6, unit="s")
        in_range("sample", self.sample, 1e-9, self.duration, unit="s")
        self._check_height()
        if self.body.through:
            self._check_bar()
        self._check_width()
        self.motion.check(self.body)

    def _check_height(self) -> None:
        """Raise ValueError for a body without grains below and above it."""
        bed = self.bed
        below = self.height + self.body.bottom
        above = bed.depth - self.height - self.body.top
        require(
            below >= CLEARANCE * bed.diameter and above >= COVER * bed.diameter,
            f"the bed is too shallow: {1e3 * below:.1f} mm below the body and "
            f"{1e3 * above:.1f} mm above",
            because=f"{CLEARANCE:g} grains must fit below and {COVER:g} above",
            instead="use a deeper bed or a thinner body",
        )

    def _check_bar(self) -> None:
        """Raise ValueError for a bar that does not span its bed."""
        bed = self.bed
        size = self.body.size
        require(
            not bed.walled,
            "a bar must span a periodic bed",
            instead="use a bed without walls",
        )
        require(
            math.isclose(size, bed.length, rel_tol=1e-6),
            f"a bar of {size:g} m must be as long as its bed, {bed.length:g} m",
        )

    def _check_width(self) -> None:
        """Raise ValueError for a body that meets the walls or its own image."""
        bed = self.bed
        body = self.body
        if body.through:
            width = bed.width
            reach = 2 * body.half_width
        else:
            width = min(bed.length, bed.width)
            reach = body.size
        margin = CLEARANCE * bed.diameter + body.half_width
        require(
            width - reach >= 2 * margin,
            f"the bed is too small: {1000.0 * width:.0f} mm for a body with a reach "
            f"of {1000.0 * reach:.0f} mm",
            because="it meets the walls"
            if bed.walled
            else ("it meets its own periodic image"),
            instead=f"use a bed {1000.0 * (reach + 2 * margin):.0f} mm wide or more",
        )

    def run(
        self,
        folder: str | Path,
        progress: Progress | None = None,
        film: float | None = None,
    ) -> Run:
        """Return the run, computed in a folder as far as it is not there.

        progress: receives the finished fraction of all time steps. film (s): between
        frames of text files there, ``frames-*.lammpstrj``, which OVITO opens as one;
        only of blocks that are computed now. Raises ValueError if grains fly off or the
        body leaves the bed: finished blocks stay."""
        self.check()
        if film is not None:
            in_range("film", film, 1e-9, 1e6, unit="s")
        folder = Path(folder).resolve()
        report = progress or _no_progress

        settling_steps = 0
        if not self.is_settled(folder):
            settling_steps = round(sum(SETTLING_TIMES) / self.bed.step)
        share = settling_steps / (settling_steps + self.n_steps)
        settled = settle(
            self.bed,
            self.body,
            self.height,
            folder,
            lambda fraction: report(share * fraction),
        )
        place = self._run_folder(folder)
        place.mkdir(parents=True, exist_ok=True)
        blocks = self._complete_blocks(
            place,
            settled,
            lambda fraction: report(share + (1 - share) * fraction),
            film,
        )
        return self._collect_run(blocks, settled)

    def _complete_blocks(
        self, place: Path, settled: SettledBed, progress: Progress, film: float | None
    ) -> list[Block]:
        """Return all blocks of a run, and compute those that its folder does not have
        yet."""
        lengths = self._block_lengths()
        blocks = _stored_blocks(place, len(lengths))
        if len(blocks) == len(lengths):
            return blocks
        with _lock(place):
            for k in range(len(blocks), len(lengths)):
                start = _state_file(place, k) if k else settled.file
                before = blocks[-1] if k else None
                step = sum(lengths[:k])
                computation = _BlockComputation(
                    self, settled.bulk, place, k, step, before, progress
                )
                blocks.append(computation.compute(start, lengths[k], film))
            _remove(_state_file(place, k) for k in range(1, len(lengths) + 1))
        return blocks

    def _block_lengths(self) -> list[int]:
        """Return the numbers of steps of the blocks."""
        most = self.sample_steps * max(1, BLOCK // self.sample_steps)
        n_full, rest = divmod(self.n_steps, most)
        lengths = [most] * n_full
        if rest:
            lengths.append(rest)
        return lengths

    def _run_folder(self, folder: Path) -> Path:
        """Return the folder of this run in a folder, named by a digest of all that it
        depends on."""
        settled_key = _settled_key(self.bed, self.body, self.height)
        content = [
            FORMAT,
            self.motion.identity(),
            self.duration,
            self.sample,
            settled_key,
        ]
        digest = hashlib.sha256(json.dumps(content, default=float).encode())
        return folder / f"run-{digest.hexdigest()[:16]}"

    def _collect_run(self, blocks: list[Block], settled: SettledBed) -> Run:
        """Return the run of all blocks."""
        series = {
            name: np.concatenate([block[name] for block in blocks]) for name in SERIES
        }
        facts = {
            **settled.facts,
            "time_step": self.bed.step,
            "steps": self.n_steps,
            "mass": self.body.mass(settled.bulk),
            "cpu": float(sum(block["cpu"] for block in blocks)),
        }
        return Run(**series, arc_length=self.body.arc_length, facts=facts)


class _BlockComputation:
    """One block of an experiment under way: the function that LAMMPS calls every step,
    and the samples of it.

    bulk: density of the packed grains, kg/m^3. index: number of the block. step: number
    of steps before it. before: the block before it."""

    def __init__(
        self,
        experiment: Experiment,
        bulk: float,
        place: Path,
        index: int,
        step: int,
        before: Block | None,
        progress: Progress,
    ):
        self.experiment = experiment
        self.place = place
        self.index = index
        self.progress = progress
        self.step = step
        self.dt = experiment.bed.step
        self.mass = experiment.body.mass(bulk)
        self.rows: dict[str, list] = {name: [] for name in SERIES}
        self.state = experiment.motion.start()
        self.work = 0.0
        if before:
            self.state = before["state"]
            self.work = float(before["work"][-1])
        self.body = self._move(0.0)
        self._clear_sums()

    def _move(self, dt: float) -> BodyState:
        """Move the state by dt, s, and return the body there."""
        experiment = self.experiment
        self.state, body = experiment.motion.move(
            self.state,
            self.step * self.dt,
            dt,
            experiment.body,
            self.mass,
            experiment.height,
        )
        return body

    def _clear_sums(self) -> None:
        self.force_sum = np.zeros(3)
        self.moment_sum = 0.0
        self.profile_sum = np.zeros((len(self.experiment.body.radius), 3))

    def compute(self, start: Path, steps: int, film: float | None) -> Block:
        """Compute the block, write its rows and the state after it, and return the
        rows."""
        experiment = self.experiment
        begin = time.process_time()
        after = _state_file(self.place, self.index + 1)
        n_body = len(experiment.body.radius)
        with Engine(experiment.bed, start, n_body, restart=True) as engine:
            if not self.index:
                self._record_energy(engine)
            if film:
                frames = self.place / f"frames-{self.index:04d}-*.lammpstrj"
                engine.film(frames, max(1, round(film / self.dt)))
            engine.steps(steps, self._next_placement)
            self._record_energy(engine)
            with _replace_file(after) as path:
                engine.write(path)

        series = {}
        for name, rows in self.rows.items():
            dtype = np.float32 if name == "profile" else float
            series[name] = np.array(rows, dtype)
        with (
            _replace_file(_rows_file(self.place, self.index)) as path,
            path.open("wb") as file,
        ):
            np.savez_compressed(
                file,
                **series,
                state=self.state,
                cpu=time.process_time() - begin,
                after=_digest(after),
            )
        if self.index:
            _remove([_state_file(self.place, self.index)])
        return _read_rows(self.place, self.index)

    def _next_placement(self, forces: Forces) -> Placement:
        """Return the body at the next step, from the forces on it at this one."""
        sphere_force, sphere_moment = forces
        body = self.body
        placement = body.placement
        arm = placement.centres[:, :2] - [body.centre.real, body.centre.imag]
        force = sphere_force.sum(0)
        about_centre = (
            arm[:, 0] * sphere_force[:, 1] - arm[:, 1] * sphere_force[:, 0]
        ).sum()
        moment = float(about_centre + sphere_moment[:, 2].sum())
        require(
            bool(np.isfinite(force).all()),
            "grains fly off",
            instead="use a smaller time step",
        )
        power = float(
            (sphere_force * placement.velocities).sum()
            + sphere_moment[:, 2] @ placement.rates
        )
        self.work -= power * self.dt
        self.force_sum = self.force_sum + force
        self.moment_sum += moment
        self.profile_sum = self.profile_sum + sphere_force

        self.state = self.experiment.motion.push(self.state, force, moment, self.dt)
        self.step += 1
        self.body = self._move(self.dt)
        self._check_move(placement.centres)
        if self.step % self.experiment.sample_steps == 0:
            self._record_sample()
        return self.body.placement

    def _check_move(self, before: np.ndarray) -> None:
        """Raise ValueError for spheres that have moved too far from their centres
        ``before`` (n, 3), m, or have left the bed."""
        bed = self.experiment.bed
        centres = self.body.placement.centres
        t = self.step * self.dt
        distance = np.abs(centres - before).max() / bed.diameter
        require(
            bool(distance <= LARGEST_MOVE),
            f"at {t:.3f} s the body moves {distance:.3f} grain diameters per step",
            because=f"contacts are resolved up to {LARGEST_MOVE:g}",
            instead="move it more slowly",
        )
        if not bed.walled:
            return
        margin = self.experiment.body.half_width + bed.diameter
        edge = np.array([bed.length, bed.width]) / 2 - margin
        require(
            bool((np.abs(centres[:, :2]) <= edge).all()),
            f"at {t:.3f} s the body leaves the bed",
            instead="use a larger bed",
        )

    def _record_sample(self) -> None:
        """Append a sample to the rows."""
        n = self.experiment.sample_steps
        body = self.body
        sample = {
            "t": self.step * self.dt,
            "force": self.force_sum / n,
            "moment": self.moment_sum / n,
            "profile": self.profile_sum / n,
            "pose": body.pose,
            "centre": (body.centre.real, body.centre.imag),
            "alpha": body.alpha,
            "work": self.work,
            "kinetic": body.kinetic,
        }
        for name, value in sample.items():
            self.rows[name].append(value)
        self._clear_sums()
        self.progress(self.step / self.experiment.n_steps)

    def _record_energy(self, engine: Engine) -> None:
        """Append energies and overlaps of the grains to the rows."""
        bed = self.experiment.bed
        particles = engine.particles()
        touching = contacts(bed, particles)
        self.rows["energy"].append((motion_energy(bed, particles), touching.elastic))
        self.rows["overlaps"].append((touching.largest, touching.mean))


class SettledBed(NamedTuple):
    """A bed at rest around a body.

    file: a restart file of LAMMPS. facts: as of `Run`. bulk: density of the packed
    grains, kg/m^3."""

    file: Path
    facts: dict[str, float]
    bulk: float


def settle(
    bed: Bed,
    body: Spheres,
    height: float,
    folder: str | Path,
    progress: Progress = _no_progress,
) -> SettledBed:
    """Return the bed at rest around a straight body whose axis is at a height (m) over
    the floor.

    It is read from the folder if it is there, else computed and stored there. progress:
    receives the finished fraction."""
    folder = Path(folder).resolve()
    _require_folder(folder)
    file = _bed_file(folder, _settled_key(bed, body, height))
    facts_file = file.with_suffix(".json")
    facts = _stored_facts(file, facts_file)
    if facts is None:
        if facts_file.exists():
            # One of both is damaged.
            with contextlib.suppress(OSError):
                os.replace(file, file.with_suffix(".damaged"))
        facts = _compute_settled(bed, body, height, file, progress)
        _write_facts(facts_file, facts, file)
    return SettledBed(file, facts, facts["packing"] * bed.density)


def _require_folder(folder: Path) -> None:
    """Make a folder; Refusal for names that LAMMPS does not take, and folders that
    cannot be made."""
    require(
        str(folder).isascii() and '"' not in str(folder),
        f"LAMMPS does not accept the folder name {folder}",
        instead="use ASCII letters, without quotes",
    )
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Refusal(
            f"cannot store beds in {folder}",
            because=error.strerror,
            instead="use another folder",
        ) from None


def _compute_settled(
    bed: Bed, body: Spheres, height: float, file: Path, progress: Progress
) -> dict[str, float]:
    """Let a bed settle around a straight body, write its restart file, and return its
    facts."""
    begin = time.process_time()
    zero = np.zeros(body.joints)
    links = body.links(zero, zero)
    middle = body.half_lengths @ links.centres / body.half_lengths.sum()
    centres = body.placement(links, -middle, 0.0, 0.0, 0.0, height).centres
    data = file.with_suffix(f".{os.getpid()}.data")
    try:
        write_data(data, bed, centres, body.radius)
        with Engine(
            bed, data, len(body.radius), restart=False, friction=bed.settling_friction
        ) as engine:
            facts = _settle(engine, bed, body, progress)
            facts["settling_cpu"] = time.process_time() - begin
            with _replace_file(file) as path:
                engine.write(path)
    finally:
        data.unlink(missing_ok=True)
    return facts


def _write_facts(facts_file: Path, facts: dict[str, float], file: Path) -> None:
    """Write the facts of a bed, with digests of them and of its restart file."""
    content = {
        "facts": facts,
        "sha256": hashlib.sha256(file.read_bytes()).hexdigest(),
        "sha256_of_facts": _digest_of_facts(facts),
    }
    with _replace_file(facts_file) as path:
        path.write_text(json.dumps(content) + "\n")


def _stored_facts(file: Path, facts_file: Path) -> dict[str, float] | None:
    """Return the facts of a stored bed; None if it is not there, or damaged."""
    try:
        content = json.loads(facts_file.read_text())
        facts = content["facts"]
        # Files of older versions have no digest of the facts.
        digest = _digest_of_facts(facts)
        is_intact = content.get("sha256_of_facts", digest) == digest
        is_intact &= file.exists() and content["sha256"] == _digest(file)
        is_intact &= is_number(facts["packing"])
    except (
        OSError,
        ValueError,
        LookupError,
        TypeError,
        AttributeError,
        RecursionError,
    ):
        return None
    return facts if is_intact else None


def _digest_of_facts(facts: dict[str, float]) -> str:
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


def _settle(
    engine: Engine, bed: Bed, body: Spheres, progress: Progress
) -> dict[str, float]:
    """Let a bed come to rest; return its facts."""
    falling, resting = (max(1, round(t / bed.step)) for t in SETTLING_TIMES)

    def report(step: int) -> None:
        progress(min(1.0, step / (falling + resting)))

    engine.settle(falling, bed.weight / GRAVITY / SLOWING_TIME, report)
    engine.settle(resting, report=report)
    calm = CALM * bed.weight * bed.diameter
    kinetic = _kinetic_energy(engine, bed)
    while kinetic > calm:
        require(
            engine.now * bed.step < LONGEST_SETTLING,
            f"the bed does not settle within {LONGEST_SETTLING:g} s: "
            f"{kinetic / calm:.1f} times the energy of one at rest",
            instead="use more friction or less restitution",
        )
        engine.settle(resting, report=report)
        kinetic = _kinetic_energy(engine, bed)

    particles = engine.particles()
    grains = ~particles.body
    surface = _surface_height(bed, particles.x[grains, 2])
    return {
        "grains": int(np.count_nonzero(grains)),
        "spheres": len(body.radius),
        "packing": _packing(bed, body, particles, surface),
        "surface": surface,
        "lammps": int(engine.lmp.version()),
    }


def _surface_height(bed: Bed, z: np.ndarray) -> float:
    """Return the height of the surface, m, over the floor, from the heights of all
    grains."""
    return float(np.quantile(z, SURFACE_QUANTILE)) + bed.diameter / 2


def _packing(bed: Bed, body: Spheres, particles: Particles, surface: float) -> float:
    """Return the share of volume that grains fill beside a body, two grains away from
    floor and surface; a grain counts where its centre lies."""
    grains = ~particles.body
    y = particles.x[grains, 1]
    z = particles.x[grains, 2]
    volume = 4 / 3 * np.pi * particles.radius[grains] ** 3
    low = 2 * bed.diameter
    high = surface - 2 * bed.diameter
    margin = body.half_width + bed.diameter
    inside = (z > low) & (z < high) & (np.abs(y) > margin)
    region = bed.length * (bed.width - 2 * margin) * (high - low)
    return float(volume[inside].sum() / region)


def _kinetic_energy(engine: Engine, bed: Bed) -> float:
    """Return the mean kinetic energy of a grain, without its spin, J."""
    p = engine.particles()
    return float(np.mean((p.v[~p.body] ** 2).sum(1))) * bed.weight / GRAVITY / 2


def _settled_key(bed: Bed, body: Spheres, height: float) -> str:
    """Return a name for all that a settled bed depends on."""
    arrays = (body.link.astype(float), body.offsets, body.radius)
    content = [
        FORMAT,
        astuple(bed),
        [array.round(12).tolist() for array in arrays],
        body.half_lengths.round(12).tolist(),
        body.density,
        height,
    ]
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()[:16]


def _bed_file(folder: Path, key: str) -> Path:
    return folder / f"bed-{key}.restart"


def _rows_file(place: Path, block: int) -> Path:
    return place / f"block-{block:04d}.npz"


def _state_file(place: Path, block: int) -> Path:
    """Return the restart file that a block begins from."""
    return place / f"before-{block:04d}.restart"


def _digest(path: Path) -> str:
    """Return the digest of a file, "" if it is not there."""
    if not path.exists():
        return ""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _read_rows(place: Path, block: int) -> Block:
    """Return the rows of a block; {} if they are not there, or damaged."""
    try:
        with _rows_file(place, block).open("rb") as file, np.load(file) as stored:
            rows = {name: stored[name] for name in stored.files}
    except Exception:  # NumPy, zipfile and zlib have many for a damaged file
        return {}
    is_complete = set(rows) == {*SERIES, "state", "cpu", "after"}
    return rows if is_complete else {}


def _stored_blocks(place: Path, n: int) -> list[Block]:
    """Return the first blocks whose rows are there and complete: all n of them, or
    those that a run can be resumed from."""
    blocks: list[Block] = []
    while len(blocks) < n:
        rows = _read_rows(place, len(blocks))
        if not rows:
            break
        blocks.append(rows)
    if len(blocks) == n:
        return blocks

    # The next block begins from the restart file after the last one.
    while blocks:
        after = str(blocks[-1].get("after", "none"))
        if after == _digest(_state_file(place, len(blocks))):
            break
        blocks.pop()
    return blocks


def _remove(paths: Iterable[Path]) -> None:
    for path in paths:
        path.unlink(missing_ok=True)


@contextlib.contextmanager
def _replace_file(path: Path) -> Iterator[Path]:
    """Yield a name to write to; the file takes the place of ``path`` once it is
    complete."""
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


@contextlib.contextmanager
def _lock(place: Path) -> Iterator[None]:
    """Lock the folder of a run; Refusal where another process computes it."""
    with (place / "lock").open("w") as file:
        if fcntl:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise Refusal(
                    f"another process is computing the run in {place}",
                    instead="wait for it, or use another folder",
                ) from None
        yield
