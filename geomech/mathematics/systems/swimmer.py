"""A body that swims in a medium by resistive force theory, solved by rft.

Abilities that depend on its parts, such as uncertain
parameters, are classes below `Swimmer`; `Swimmer.capability` returns them."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

import rft
from geomech.core.errors import UnitWarning
from geomech.core.work import iterate
from geomech.mathematics.geometry.reconstruct import displacement, poses, repeated
from geomech.mathematics.geometry.representations.images import cycle_images
from geomech.mathematics.geometry.traits import MEAN, Traits
from geomech.mathematics.systems.base import SYSTEMS, Cycle, System, refuse_mutable
from geomech.mathematics.systems.capabilities import (
    BalanceSize,
    Compliant,
    Diagnosed,
    Drawable,
    Loaded,
    Part,
    PartlyLifted,
    Recorded,
    Stepped,
    Symbolic,
    Uncertain,
)
from geomech.mathematics.systems.premises import refuse
from geomech.mathematics.systems.solver import Solver
from rft.bodies import BODIES
from rft.bodies.base import (
    body_size,
    checked_body,
    half_lengths,
    is_reversible,
    is_symmetric,
    joint_speed,
)
from rft.bodies.pieces import PIECES, subdivide
from rft.contacts import (
    CONTACTS,
    ContactRule,
    ContactState,
    Touching,
)
from rft.core.checks import unmasked
from rft.core.notes import warn
from rft.core.premise import SHAPE_ALONE, Premise
from rft.core.refusal import Refusal, located, require
from rft.effects import EFFECTS
from rft.effects.contact import assemble, varies_along
from rft.formulas import se2
from rft.formulas.quadrature import QUADRATURE
from rft.laws import (
    CATALOGUE,
    LAWS,
    is_closed,
    is_linear,
    is_mirror,
    is_rate_independent,
    speed_exponent,
)
from rft.laws.base import is_odd, require_law
from rft.laws.batch import MediumBatch, members
from rft.laws.catalogue import DEPTH
from rft.laws.records import record, rule_for
from rft.motion.stepping import Row, State, Stepping

# Of a scene's tables.
PARTS = {"medium": LAWS, "body": BODIES, "contact": CONTACTS, "effects": EFFECTS}
RATES = Premise.RATE_INDEPENDENT
SHAPE = Premise.PRESCRIBED_SHAPE
# By the names that a scene may give.
MEDIA = {name: entry.medium for name, entry in CATALOGUE.items()}
# Radii of end caps over the shortest link (assumed), and over a continuous body.
SMALLEST_CAP = 0.02
SMALLEST_CAP_OF_BODY = 0.008
# Phase over which contact comes or goes, rad, that counts as a jump: a step of 64
# phases.
SUDDEN = 0.1


@SYSTEMS.register
@dataclass(frozen=True)
class Swimmer:
    """A body in a medium, with effects.

    contact: which part of the body touches the ground when; None for all of it, always.
    Where contact follows the phase, its phase is the last shape variable. solver: how
    the balance of forces is solved.

    Examples
    --------
    >>> from geomech.mathematics.systems import Swimmer
    >>> from rft import Chain, Viscous
    >>> swimmer = Swimmer(Viscous(), Chain())
    >>> swimmer.velocity([0.5, 0.3], [1.0, 0.0]).round(4)
    array([-0.0014, -0.0035, -0.0817])
    """

    medium: rft.Medium
    body: rft.Body
    effects: tuple[rft.effects.Effect, ...] = ()
    solver: Solver = field(default=Solver())
    contact: ContactRule | None = None

    kind = "swimmer"

    def __post_init__(self):
        if isinstance(self.body, Touching):
            require(
                self.contact is None,
                "the body has a rule of contact already",
                instead="leave ``contact`` out",
            )
            object.__setattr__(self, "contact", self.body.contact)
            object.__setattr__(self, "body", self.body.inner)
        checked_body(self.body)
        refuse_mutable(self.body)
        rft.effects.broken_premises(self.effects)
        # Tables are stored by a hash, which a list has not.
        object.__setattr__(self, "effects", tuple(self.effects))
        with located("[contact]"):
            self.touching_body  # noqa: B018 (checks contact)
        if not isinstance(self.solver, Solver):
            raise Refusal("solver must be Solver(...)", value=self.solver)
        self._agree()
        kinds = [type(e) for e in self.effects]
        for effect in self.effects:
            if kinds.count(type(effect)) > 1:
                raise Refusal(
                    f"[[effects]] {effect.kind} is listed twice",
                    instead="keep one of them",
                )
        self._check_medium()

    def _check_medium(self) -> None:
        """Refuse a medium that is none, or that the solver or an effect does not
        take."""
        require_law(self.medium)
        refuse_mutable(self.medium)
        with located("[numerics]"):
            record(self.medium, self.solver.loads)
        for effect in self.effects:
            with located("[[effects]]"):
                own = effect.in_body_lengths(self.body.length)
                for medium in members(self.medium):
                    own.check(medium)
                    own.check_body(self.body, medium)

    def in_medium(self, medium: rft.Medium) -> Swimmer:
        """Return the swimmer in another medium, which alone is checked."""
        new = object.__new__(type(self))
        new.__dict__.update(self.__getstate__(), medium=medium)
        new._check_medium()
        return new

    def __getstate__(self) -> dict:
        # Without cached values.
        return {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}

    def _agree(self) -> None:
        """Refuse effects, or a body, that contradict each other about the swimmer's
        frequency or length."""
        self._check_one_value("frequency", [])
        lengths = []
        if self.body.length is not None:
            lengths.append(("[body]", self.body.length))
        self._check_one_value("length", lengths)

    def _check_one_value(self, quantity: str, known: list[tuple[str, Any]]) -> None:
        """Refuse effects that have another value of a quantity than others, or than
        known (name, value)."""
        values = [*known]
        for effect in self.effects:
            if getattr(effect, quantity, None) is not None:
                values.append((effect.kind, getattr(effect, quantity)))
        for name, value in values[1:]:
            first_name, first_value = values[0]
            if np.any(np.asarray(value) != first_value):
                raise Refusal(
                    f"{first_name} gives {quantity} = {first_value!r}"
                    f" and {name} {value!r}",
                    because="both belong to one swimmer",
                )

    @cached_property
    def touching_body(self) -> rft.Body:
        """The body with its contact; itself where all of it touches."""
        if self.contact is None:
            return self.body
        return Touching(self.body, self.contact)

    @property
    def joints(self) -> int:
        """Number of shape variables."""
        return self.touching_body.joints

    @property
    def length(self) -> float | None:
        """Length of the body, m; None where lengths are in body lengths."""
        return self.body.length

    @property
    def closed(self) -> bool:
        """Whether the refined swimmer has exact integrals over elements."""
        return is_closed(self.medium)

    @cached_property
    def traits(self) -> Traits:
        medium = self.medium
        body = self.body
        effects = self.effects
        lifted = hasattr(self.touching_body, "contact_factors")
        is_central = is_odd(medium)
        is_reversed = is_central and is_reversible(body)
        is_reversed = is_reversed and not effects and not lifted
        lacks = rft.effects.broken_premises(effects)
        is_compliant = bool(lacks & SHAPE)
        lacks &= ~SHAPE
        if not is_rate_independent(medium):
            lacks |= RATES
        power_degree = None
        if not lacks & RATES:
            power_degree = speed_exponent(medium) + 1.0
        frequencies = [
            e.frequency for e in effects if getattr(e, "frequency", None) is not None
        ]
        return Traits(
            linear=is_linear(medium) and not effects,
            odd=is_central and all(e.odd for e in effects),
            mirror=is_mirror(medium) and is_symmetric(body) and not lifted,
            reversible=is_reversed,
            smooth=is_linear(medium),
            power_degree=power_degree,
            lacks=lacks,
            joint_angles=_has_joint_angles(body),
            frame=getattr(body, "frame", MEAN),
            labels=getattr(self.touching_body, "shape_labels", ()),
            periods=getattr(self.touching_body, "shape_periods", ()),
            jumps=_switch(self.contact or body) < SUDDEN,
            frequency=frequencies[0] if frequencies else None,
            compliant=is_compliant,
        )

    def capability(self, kind: type) -> Any:
        """Return the object with an ability, which depends on medium, body and
        effects."""
        if kind is Drawable:
            body = self.touching_body
            return body if isinstance(self.body, Drawable) else None
        if kind is Uncertain:
            has_names = hasattr(self.medium, "uncertain")
            if has_names and getattr(self.medium, "covariance", None) is not None:
                return _Uncertainty(self)
            return None
        if kind is Stepped:
            return _RepeatedCycles(self) if self.traits.steps else None
        if kind is PartlyLifted:
            is_lifted = hasattr(self.touching_body, "contact_factors")
            return self if is_lifted else None
        if kind is Loaded and hasattr(self.body, "leg_points"):
            return None
        if kind is Compliant:
            return self if self.traits.compliant else None
        if kind in (Diagnosed, Recorded, Symbolic):
            return _Facts(self)
        return self if isinstance(self, kind) else None

    @property
    def parts(self) -> tuple[Part, ...]:
        """Parts that break premises: a law whose drag is of no single power of the
        speed, and effects."""
        parts = [Part("effect", e.kind, e.breaks) for e in self.effects]
        if not is_rate_independent(self.medium):
            parts.insert(0, Part("law", name_in(LAWS, self.medium), RATES))
        return tuple(parts)

    @property
    def balance_size(self) -> BalanceSize:
        """Size of the balance of forces that one velocity takes."""
        solver = self.solver
        effects = self.effects
        medium = members(self.medium)[0]  # whose size is that of the others
        assembly = assemble(
            medium, self.touching_body, effects, solver.loads, solver.pieces
        )
        pieces = 0
        if varies_along(self.touching_body, effects):
            # Elements that are shorter than a piece are not cut.
            elements = 0.5 / half_lengths(self.body).max()
            pieces = max(solver.pieces, int(np.ceil(elements - 1e-9)))
        values = [getattr(e, name) for e in effects for name in e.batched]
        return BalanceSize(
            elements=assembly.n_elements,
            evaluations=assembly.n_law_points,
            pieces=pieces,
            memory=sum(e.memory_size for e in assembly.effects),
            batched=isinstance(self.medium, MediumBatch) or any(map(np.ndim, values)),
        )

    def with_solver(self, solver: Solver) -> Swimmer:
        """Return the swimmer with another solver."""
        return dataclasses.replace(self, solver=solver)

    def in_frame(self, frame: str) -> Swimmer:
        """Return the swimmer with xi in another frame of its body."""
        body = dataclasses.replace(self.body, frame=frame)
        return dataclasses.replace(self, body=body)

    def commanded(self, alpha: ArrayLike) -> np.ndarray:
        """Return shapes (..., d) of a gait with the joints that no actuator moves at
        rest."""
        alpha = np.array(alpha, float)
        for effect in self.effects:
            if isinstance(effect, rft.Springs):
                springs = effect.of_body(self.body, members(self.medium)[0])
                passive = np.flatnonzero(springs.actuated[:, 0] == 0)
                alpha[..., passive] = springs.rest[passive, 0]
        return alpha

    def _settings(self, *names: str) -> dict:
        """Return the effects and settings of the solver, as arguments of rft's
        functions."""
        settings = {"effects": self.effects}
        for name in ("loads", "regularisation", "pieces", *names):
            settings[name] = getattr(self.solver, name)
        return settings

    def solve(
        self, alpha: ArrayLike, alphadot: ArrayLike, start: ArrayLike | None = None
    ) -> rft.Solution:
        """Return body velocities with residual and status for alpha, alphadot (...,
        joints); see `rft.body_velocity`.

        Iterations begin from ``start`` (..., 3) where given. Refusal if velocities do
        not follow from shape alone."""
        return self._body_velocity(alpha, alphadot, start)

    @cached_property
    def _body_velocity(self) -> rft.BodyVelocity:
        """The balance of forces, assembled once; Refusal if velocities do not follow
        from shape alone."""
        refuse(
            self,
            "body velocity from shape alone",
            SHAPE_ALONE,
            "run a whole gait with the direct tier",
        )
        settings = self.prescribed._settings("tolerance", "backend")
        return rft.BodyVelocity(self.medium, self.touching_body, **settings)

    @cached_property
    def prescribed(self) -> Swimmer:
        """The swimmer with its joints held at the gait; itself where they are."""
        rigid = tuple(e for e in self.effects if not e.breaks & SHAPE)
        if len(rigid) == len(self.effects):
            return self
        return dataclasses.replace(self, effects=rigid)

    def velocity(
        self, alpha: ArrayLike, alphadot: ArrayLike, start: ArrayLike | None = None
    ) -> np.ndarray:
        """Return xi (..., 3) in the body's frame, begun from ``start`` as in `solve`;
        RuntimeError if any sample did not converge."""
        return self.solve(alpha, alphadot, start).checked().xi

    def power(self, alpha: ArrayLike, alphadot: ArrayLike, xi: ArrayLike) -> np.ndarray:
        """Return the rate of work (...) of a solution of `solve`, in axial drags of the
        whole body times body lengths per unit of time."""
        return self.work(alpha, alphadot, xi).power / body_size(self)

    def work(self, alpha: ArrayLike, alphadot: ArrayLike, xi: ArrayLike) -> rft.Work:
        """Return power, internal moments and slip of a solution of `solve`; see
        `rft.work_done`."""
        return rft.work_done(
            self.medium, self.touching_body, alpha, alphadot, xi, **self._settings()
        )

    def elements(self, alpha: ArrayLike, alphadot: ArrayLike) -> rft.bodies.Elements:
        """Return the elements (n, N) of the body at shapes and rates (N, d), in a fixed
        frame."""
        alpha = unmasked("x", alpha)
        return self.touching_body.motion(alpha.T, unmasked("x", alphadot).T)

    def subdivided(self) -> Swimmer:
        """Return the swimmer with its body cut into short elements."""
        pieces = max(PIECES, self.balance_size.pieces)
        return dataclasses.replace(self, body=subdivide(self.body, pieces))

    def contact_state(self, alpha: ArrayLike, heading: ArrayLike) -> ContactState:
        """Return what touches at shapes (B, joints) and headings (B,) of the frame on
        the ground, rad."""
        body: Any = self.touching_body
        alpha = unmasked("alpha", alpha)
        shift = np.zeros(len(alpha), complex)
        slope = self.slope
        if slope is not None:
            downhill = -np.exp(1j * (slope.towards - unmasked("heading", heading)))
            shift = body.height * np.tan(slope.angle) * downhill
        return body.contact_state(alpha, shift, self.solver.pieces)

    @property
    def slope(self) -> rft.Slope | None:
        """The slope on which the swimmer moves, None on level ground."""
        for effect in self.effects:
            if isinstance(effect, rft.Slope):
                return effect
        return None

    @property
    def axial_drag(self) -> float:
        """Drag on the whole straight body along itself, in the law's unit of force."""
        return assemble(self.medium, self.body).axial_drag

    def axial_stress(self, depth: float) -> float | None:
        """Return the axial drag over projected area, Pa, at a depth, m; None unless the
        medium is a measured one."""
        for entry in CATALOGUE.values():
            if entry.medium == self.medium:
                stress = entry.axial_stress
                return None if stress is None else stress * depth / DEPTH
        return None

    def time_steps(
        self,
        alpha: ArrayLike,
        alphadot: ArrayLike,
        cycles: int | None,
        work: bool = False,
        path: bool = False,
        start: ArrayLike | None = None,
    ) -> rft.TimeSteps:
        """Return the gait computed phase after phase (`rft.time_steps`), without
        checking convergence. start: shape of joints that give way before it."""
        context = (Swimmer.time_steps, self, alpha, alphadot, cycles is None)
        if start is not None:
            context = (*context, np.asarray(start, float))

        def advance(
            stepping: Stepping, state: State, count: int, with_work: bool
        ) -> tuple[State, list[Row]]:
            step = partial(stepping.step, with_work=with_work)
            return iterate(step, state, count, (*context, with_work), Row)

        return rft.time_steps(
            self.medium,
            self.touching_body,
            alpha,
            alphadot,
            advance=advance,
            cycles=cycles,
            with_work=work,
            with_path=path,
            start=start,
            **self._settings("tolerance", "backend"),
        )

    def run(
        self,
        alpha: ArrayLike,
        alphadot: ArrayLike,
        work: bool = False,
        start: ArrayLike | None = None,
    ) -> Cycle:
        """Run a gait given by alpha, alphadot (..., N, joints) at N equally spaced
        phases, by the cheapest engine that is right.

        Balances begin from ``start`` as in `solve`, steps of time from the step before.
        RuntimeError if a force balance did not converge or cycles did not become
        periodic."""
        rates = alphadot.reshape(-1, self.joints).T
        speed = (
            joint_speed(self.touching_body, rates).reshape(alphadot.shape[:-1]).mean(-1)
        )
        if not self.traits.steps:
            return self._run_phases(alpha, alphadot, work, start, speed)

        steps = self.time_steps(alpha, alphadot, self.solver.cycles, work).checked()
        net = steps.displacement
        if self._repeats(steps):
            net = displacement(steps.xi)
        to_come = 0.0 * speed
        if self._settling:
            to_come = steps.drift
        return Cycle(
            xi=steps.xi,
            net=net,
            residual=steps.residual,
            speed=speed,
            work=steps.work,
            cycles=steps.cycles,
            to_come=to_come,
            springs=steps.springs,
        )

    def _run_phases(self, alpha, alphadot, work: bool, start, speed) -> Cycle:
        """Return the cycle of `run` where velocities follow from shape alone, from as
        few phases as symmetry allows."""
        images = cycle_images(alpha, alphadot, self.traits)
        swimmer = self._for_gaits(speed.size, images.count)
        solution = swimmer.solve(
            images.select(alpha), images.select(alphadot), images.select(start)
        ).checked()
        xi = images.expand(solution.xi)
        work_done = None
        if work:
            swimmer = self._for_gaits(speed.size, alpha.shape[-2])
            work_done = swimmer.work(alpha, alphadot, xi)
        return Cycle(
            xi=xi,
            net=displacement(xi),
            residual=solution.residual.max(-1),
            speed=speed,
            work=work_done,
            cycles=1,
            to_come=0.0 * speed,
        )

    @property
    def _settling(self) -> float:
        """Change of displacement at which cycles count as repeating; 0 if they are not
        run until they do."""
        place_matters = self.traits.lacks & Premise.SE2_SYMMETRIC
        if not self.traits.steps or self.solver.cycles is not None or place_matters:
            return 0.0
        return max(e.drift_tolerance for e in self.effects)

    def _for_gaits(self, count: int, phases: int) -> Swimmer:
        """Return the swimmer for ``count`` gaits of ``phases`` phases each, where
        media, or parameters of effects, differ between gaits."""
        gaits = np.repeat(np.arange(count), phases)
        medium = self.medium
        if isinstance(medium, MediumBatch):
            medium = medium.take(gaits)
        effects = tuple(e.take(gaits) for e in self.effects)
        unchanged = all(a is b for a, b in zip(effects, self.effects))
        if medium is self.medium and unchanged:
            return self
        return dataclasses.replace(self, medium=medium, effects=effects)

    def _repeats(self, steps: rft.TimeSteps) -> bool:
        """Return whether cycles are equal: the velocity is then periodic, and its
        integral exact for the series through it."""
        if self.traits.lacks & Premise.SE2_SYMMETRIC:
            return False
        return (steps.status == "periodic").all()

    def refined(self) -> Swimmer | None:
        """Return the swimmer with a velocity closer to the exact one; None where it is
        exact."""
        finer = {}
        rule, count = rule_for(self.medium, self.solver.loads)
        if rule != "exact":
            finer["loads"] = f"{rule}:{min(2 * count, 1000)}"
            if self.closed:
                finer["loads"] = "exact"
        if not self.traits.linear:
            finer["regularisation"] = max(self.solver.regularisation / 10, 1e-12)
        if not finer:
            return None
        return self.with_solver(dataclasses.replace(self.solver, **finer))

    @classmethod
    def examples(cls) -> dict[str, Swimmer]:
        body = rft.Chain((0.7, 1.4, 0.9), frame="link-1", length=0.3)
        return {"swimmer": cls(MEDIA["glass-0.3mm-loose"], body)}


@dataclass(frozen=True)
class _Uncertainty:
    """`Uncertain`: a swimmer in a medium whose parameters have a covariance."""

    swimmer: Swimmer

    @property
    def covariance(self) -> tuple:
        """Covariance of the medium's parameters, as measured."""
        return self.swimmer.medium.covariance

    def varied(self, step: np.ndarray) -> Swimmer:
        """Return the swimmer in a medium whose uncertain parameters are changed by
        ``step`` (n,); Refusal if there is no such medium."""
        medium = self.swimmer.medium
        changed = {
            name: getattr(medium, name) + float(change)
            for name, change in zip(medium.uncertain, step)
        }
        try:
            medium = dataclasses.replace(medium, covariance=None, **changed)
            return dataclasses.replace(self.swimmer, medium=medium)
        except ValueError as error:
            raise Refusal(
                "[medium] covariance",
                because=(
                    f"one standard deviation away the medium is not valid ({error})"
                ),
                instead="measure more drag, or leave the covariance out",
            ) from None


@dataclass(frozen=True)
class _RepeatedCycles:
    """`Stepped`: a swimmer whose cycles are stepped through time."""

    swimmer: Swimmer

    @property
    def settling(self) -> float:
        return self.swimmer._settling

    def path(
        self, alpha: ArrayLike, alphadot: ArrayLike, cycles: int = 1
    ) -> np.ndarray:
        """Return poses of the limit cycle; where cycles do not repeat, from the cycle
        that `Swimmer.run` returns."""
        swimmer = self.swimmer
        asked = swimmer.solver.cycles
        if not swimmer.traits.lacks & Premise.SE2_SYMMETRIC:
            steps = swimmer.time_steps(alpha, alphadot, asked).checked()
            if swimmer._repeats(steps):
                return repeated(poses(steps.xi), cycles)
        before = (asked or 1) - 1
        steps = swimmer.time_steps(alpha, alphadot, before + cycles, path=True)
        poses_after = steps.checked().path[before * len(alpha) :]
        return se2.compose(se2.inverse(poses_after[:1]), poses_after)


@dataclass(frozen=True)
class _Facts:
    """`Diagnosed`, `Recorded` and `Symbolic`: facts about a swimmer's velocity."""

    swimmer: Swimmer

    def diagnosed(self, alpha: ArrayLike, alphadot: ArrayLike) -> dict:
        """Return velocity, status, residual and iterations for one shape and rate
        (d,)."""
        solution = self.swimmer.solve(alpha, alphadot)
        if str(solution.status) == "unconverged":
            raise Refusal(
                "the force balance did not converge",
                instead="raise [numerics] regularisation",
            )
        return {
            "xi": solution.xi.tolist(),
            "status": str(solution.status),
            "residual": float(solution.residual),
            "iterations": int(solution.iterations),
        }

    def about(self) -> dict:
        """Return attributes for a file of the connection."""
        solver = self.swimmer.solver
        loads = solver.loads
        if loads == "exact" and not self.swimmer.closed:
            loads = QUADRATURE
        return {
            "loads": loads,
            "regularisation": float(solver.regularisation),
            "regularisation_unit": "body length rad-1",
        }

    def symbolic(self) -> tuple[Any, tuple[Any, ...]]:
        """Return A (3, d) as a sympy Matrix, and its shape variables."""
        from geomech.mathematics.symbolic import connections

        swimmer = self.swimmer
        body = swimmer.body
        is_plain = type(body) is rft.Chain and body.modes is None
        is_viscous = type(swimmer.medium) is rft.Viscous
        if not (swimmer.traits.linear and is_plain and is_viscous):
            raise Refusal(
                "a formula is available only for a chain of links in a viscous medium "
                "without effects"
            )
        A, alpha = connections.viscous_chain(
            body.lengths, swimmer.medium.ratio, body.frame
        )
        return connections.in_length(body_size(swimmer), A), alpha


def effect_sizes(effect: rft.effects.Effect, body: rft.Body) -> str:
    """Return the lengths of an effect in mm and in body lengths, as text; "" for one
    without, and for a body without a length."""
    if body.length is None:
        return ""
    own = effect.in_body_lengths(body.length)
    texts = []
    for name, metres in effect.metres.items():
        value = getattr(own, name)
        if metres.power == 1 and np.ndim(value) == 0:
            mm = 1e3 * body.length * value
            texts.append(f"{name} {mm:.4g} mm, {value:.4g} body lengths")
    return "; ".join(texts)


def note_radius(swimmer: Swimmer) -> None:
    """Warn (`UnitWarning`) of end caps whose radius is likely in another unit: longer
    than the link that they close, or less than a fiftieth of it. A continuous body has
    no links; there the limits are a quarter and 1/500 of its length (all assumed)."""
    body = swimmer.body
    for effect in swimmer.effects:
        if not isinstance(effect, rft.EndCaps):
            continue
        radius = effect.in_body_lengths(body.length).radius
        has_links = hasattr(body, "fractions")
        smallest = SMALLEST_CAP if has_links else SMALLEST_CAP_OF_BODY
        fractions = getattr(body, "fractions", np.array([0.25]))
        links = []
        if effect.tail > 0:
            links.append(fractions[0])
        if effect.head > 0:
            links.append(fractions[-1])
        if radius == 0 or not links:
            continue
        if smallest * max(links) <= radius <= min(links):
            continue

        size = 1.0
        unit = "body lengths"
        if body.length is not None:
            size = 1e3 * body.length
            unit = "mm"
        whole = f"a body of {size:.3g} {unit}"
        if has_links:
            link = min(links) if radius > min(links) else max(links)
            whole = f"a link of {size * link:.3g} {unit}"
        warn(
            f"end-caps have a radius of {size * radius:.3g} {unit} on {whole}: is the "
            "radius in another unit?",
            UnitWarning,
        )


def _switch(part: Any) -> float:
    """Return the phase over which contact comes or goes, rad; inf for a body or a rule
    of contact without such a phase."""
    return getattr(part, "rise", np.inf)


def _has_joint_angles(body: rft.Body) -> bool:
    """Return whether shape variables are angles of joints; some bodies have amplitudes
    of bends or modes instead."""
    if not isinstance(body, (rft.Chain, rft.Backbone)):
        return False
    names = ("bends", "modes")
    return all(getattr(body, name, None) is None for name in names)


def is_three_link(system: System) -> bool:
    """Return whether a system is the three-link swimmer, which the published gaits are
    for."""
    if not isinstance(system, Swimmer) or not isinstance(system.body, rft.Chain):
        return False
    return len(system.body.lengths) == 3 and system.body.modes is None


def name_in(kinds: dict, part) -> str:
    """Return the name of a part in ``kinds``, or the name of its class."""
    for name, kind in kinds.items():
        if type(part) is kind:
            return name
    return type(part).__name__
