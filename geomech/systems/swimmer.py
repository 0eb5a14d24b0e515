"""A body that swims in a medium by resistive force theory: the one user of rft's solver."""

from __future__ import annotations

import dataclasses
import warnings
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

import rft
from geomech.core.errors import UnitWarning
from geomech.core.work import iterate
from geomech.geometry.images import cycle_images
from geomech.geometry.reconstruct import displacement, poses, repeated
from geomech.geometry.traits import MEAN, Traits
from geomech.systems.base import SYSTEMS, Cycle, System, refuse_mutable
from geomech.systems.capabilities import BalanceSize, Drawable, Part, Stepped, Uncertain
from geomech.systems.premises import refuse
from geomech.systems.solver import Solver
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
from rft.core.checks import unmasked
from rft.core.premise import NONE, SHAPE_ALONE, Premise
from rft.core.refusal import Refusal, located
from rft.effects import EFFECTS
from rft.effects.contact import assemble
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
from rft.laws.catalogue import DEPTH
from rft.laws.records import record, rule_for
from rft.motion.stepping import Row, State, Stepping

PARTS = {"medium": LAWS, "body": BODIES, "effects": EFFECTS}  # of a scene's tables
RATES = Premise.RATE_INDEPENDENT
MEDIA = {
    name: entry.medium for name, entry in CATALOGUE.items()
}  # by the name a scene may give


@SYSTEMS.register
@dataclass(frozen=True)
class Swimmer:
    """A body in a medium, with the effects it is asked to have.

    Examples
    --------
    >>> from geomech.systems import Swimmer
    >>> from rft import Chain, Viscous
    >>> swimmer = Swimmer(Viscous(), Chain())
    >>> swimmer.velocity([0.5, 0.3], [1.0, 0.0]).round(4)
    array([-0.0014, -0.0035, -0.0817])
    """

    medium: rft.Medium
    body: rft.Body
    effects: tuple[rft.effects.Effect, ...] = ()
    solver: Solver = field(default=Solver())

    kind = "swimmer"

    def __post_init__(self):
        require_law(self.medium)
        checked_body(self.body)
        refuse_mutable(self.medium, self.body)
        rft.effects.broken_premises(self.effects)
        object.__setattr__(
            self, "effects", tuple(self.effects)
        )  # a list has no hash, by which tables are kept
        if not isinstance(self.solver, Solver):
            raise Refusal("solver must be Solver(...)", value=self.solver)
        with located("[numerics]"):
            record(self.medium, self.solver.loads)
        self._agree()
        kinds = [type(e) for e in self.effects]
        for effect in self.effects:
            if kinds.count(type(effect)) > 1:
                raise Refusal(
                    f"[[effects]] {effect.kind} is asked for twice", instead="keep one"
                )
            with located("[[effects]]"):
                effect.in_body_lengths(self.body.length).check(self.medium)

    def __getstate__(self) -> dict:
        return {
            f.name: getattr(self, f.name) for f in dataclasses.fields(self)
        }  # not what is cached

    def _agree(self) -> None:
        """Raise Refusal if effects, or the body, contradict each other about the swimmer's frequency or length."""
        lengths = []
        if self.body.length is not None:
            lengths.append(("[body]", self.body.length))
        for quantity, values in (("frequency", []), ("length", lengths)):
            values += [
                (e.kind, getattr(e, quantity))
                for e in self.effects
                if hasattr(e, quantity)
            ]
            for name, value in values[1:]:
                if np.any(np.asarray(value) != values[0][1]):
                    raise Refusal(
                        f"{values[0][0]} gives {quantity} = {values[0][1]!r} and {name} {value!r}",
                        because="it is one swimmer",
                    )

    joints = property(lambda self: self.body.joints)
    length = property(lambda self: self.body.length)
    closed = property(lambda self: is_closed(self.medium))

    @cached_property
    def traits(self) -> Traits:
        medium, body, effects = self.medium, self.body, self.effects
        lawful, central = is_rate_independent(medium), is_odd(medium)
        lacks = rft.effects.broken_premises(effects) | (NONE if lawful else RATES)
        return Traits(
            linear=is_linear(medium) and not effects,
            odd=central and all(e.odd for e in effects),
            mirror=is_mirror(medium) and is_symmetric(body),
            reversible=not effects and central and is_reversible(body),
            smooth=is_linear(medium),
            power_degree=None if lacks & RATES else speed_exponent(medium) + 1.0,
            lacks=lacks,
            joint_angles=_has_joint_angles(body),
            frame=getattr(body, "frame", MEAN),
            labels=getattr(body, "shape_labels", ()),
            frequency=next(
                (e.frequency for e in effects if hasattr(e, "frequency")), None
            ),
        )

    def capability(self, kind: type) -> Any:
        """Return itself if it has the ability, which depends on its medium, its body and its effects."""
        medium = self.medium
        if kind is Drawable:
            return self.body if isinstance(self.body, Drawable) else None
        has = {
            Uncertain: hasattr(medium, "uncertain")
            and getattr(medium, "covariance", None) is not None,
            Stepped: self.traits.steps,
        }
        return self if has.get(kind, isinstance(self, kind)) else None

    @property
    def parts(self) -> tuple[Part, ...]:
        """Parts that break premises: the law whose drag is of no one power of the speed, and effects."""
        law = (
            ()
            if is_rate_independent(self.medium)
            else (Part("law", name_in(LAWS, self.medium), RATES),)
        )
        return law + tuple(Part("effect", e.kind, e.breaks) for e in self.effects)

    def about(self) -> dict:
        exact = self.closed or self.solver.loads != "exact"
        return {
            "loads": self.solver.loads if exact else QUADRATURE,
            "regularisation": float(self.solver.regularisation),
            "regularisation_unit": "body length rad-1",
        }

    @property
    def covariance(self) -> tuple | None:
        """Covariance of the medium's parameters, as measured."""
        return self.medium.covariance

    def varied(self, step: np.ndarray) -> Swimmer:
        """Return the swimmer in a medium whose uncertain parameters are changed by ``step`` (n,); Refusal if that is no
        medium."""
        changed = {
            name: getattr(self.medium, name) + float(d)
            for name, d in zip(self.medium.uncertain, step)
        }
        try:
            return dataclasses.replace(
                self,
                medium=dataclasses.replace(self.medium, covariance=None, **changed),
            )
        except ValueError as error:
            raise Refusal(
                "[medium] covariance",
                because=f"a standard deviation away there is no medium ({error})",
                instead="measure more drag, or leave the covariance out",
            ) from None

    @property
    def settling(self) -> float:
        place_matters = self.traits.lacks & Premise.SE2_SYMMETRIC
        runs_on = self.traits.steps and self.solver.cycles is None and not place_matters
        return max(e.drift_tolerance for e in self.effects) if runs_on else 0.0

    @property
    def balance_size(self) -> BalanceSize:
        solver, effects, pieces = self.solver, self.effects, 0
        assembly = assemble(
            self.medium, self.body, effects, solver.loads, solver.pieces
        )
        if any(
            e.varies_along for e in effects
        ):  # see elements that are shorter than a piece whole
            pieces = max(
                solver.pieces, int(np.ceil(0.5 / half_lengths(self.body).max() - 1e-9))
            )
        batched = any(np.ndim(getattr(e, name)) for e in effects for name in e.batched)
        memory = sum(e.memory_size for e in assembly.effects)
        return BalanceSize(
            assembly.n_elements, assembly.n_law_points, pieces, memory, batched
        )

    def with_solver(self, solver: Solver) -> Swimmer:
        return dataclasses.replace(self, solver=solver)

    def in_frame(self, frame: str) -> Swimmer:
        return dataclasses.replace(
            self, body=dataclasses.replace(self.body, frame=frame)
        )

    def _settings(self, *names: str) -> dict:
        """Return settings of the solver, and the effects, as arguments of rft's functions."""
        names = ("loads", "regularisation", "pieces", *names)
        return {
            "effects": self.effects,
            **{name: getattr(self.solver, name) for name in names},
        }

    def solve(
        self, alpha: ArrayLike, alphadot: ArrayLike, start: ArrayLike | None = None
    ) -> rft.Solution:
        """Return body velocities with residual and status for alpha, alphadot (..., joints), begun from ``start`` (...,
        3) where given; see `rft.body_velocity`. Refusal if they do not follow from shape alone."""
        refuse(
            self,
            "body velocity from shape alone",
            SHAPE_ALONE,
            "run a whole gait by the direct tier",
        )
        settings = self._settings("tolerance", "backend")
        return rft.body_velocity(
            self.medium, self.body, alpha, alphadot, start=start, **settings
        )

    def velocity(
        self, alpha: ArrayLike, alphadot: ArrayLike, start: ArrayLike | None = None
    ) -> np.ndarray:
        """Return xi (..., 3) in the body's frame, begun from ``start`` as in `solve`; RuntimeError if any sample did
        not converge."""
        return self.solve(alpha, alphadot, start).checked().xi

    def diagnosed(self, alpha: ArrayLike, alphadot: ArrayLike) -> dict:
        s = self.solve(alpha, alphadot)
        if str(s.status) == "unconverged":
            raise Refusal(
                "the force balance did not converge",
                instead="raise [numerics] regularisation",
            )
        status = {
            "status": str(s.status),
            "residual": float(s.residual),
            "iterations": int(s.iterations),
        }
        return {"xi": s.xi.tolist(), **status}

    def symbolic(self) -> tuple[Any, tuple[Any, ...]]:
        from geomech.symbolic import connections

        plain = type(self.body) is rft.Chain and self.body.modes is None
        if not (self.traits.linear and plain and type(self.medium) is rft.Viscous):
            raise Refusal(
                "a formula is that of a chain of links in a viscous medium without effects"
            )
        A, alpha = connections.viscous_chain(
            self.body.lengths, self.medium.ratio, self.body.frame
        )
        return connections.in_length(body_size(self), A), alpha

    def power(self, alpha: ArrayLike, alphadot: ArrayLike, xi: ArrayLike) -> np.ndarray:
        return self.work(alpha, alphadot, xi).power / body_size(self)

    def work(self, alpha: ArrayLike, alphadot: ArrayLike, xi: ArrayLike) -> rft.Work:
        """Return power, internal moments and slip of a solution of `solve`; see `rft.work_done`."""
        return rft.work_done(
            self.medium, self.body, alpha, alphadot, xi, **self._settings()
        )

    def elements(self, alpha: ArrayLike, alphadot: ArrayLike) -> rft.bodies.Elements:
        return self.body.motion(*(unmasked("x", x).T for x in (alpha, alphadot)))

    def subdivided(self) -> Swimmer:
        return dataclasses.replace(
            self, body=subdivide(self.body, max(PIECES, self.balance_size.pieces))
        )

    @property
    def axial_drag(self) -> float:
        return assemble(self.medium, self.body).axial_drag

    def axial_stress(self, depth: float) -> float | None:
        stresses = (
            entry.axial_stress
            for entry in CATALOGUE.values()
            if entry.medium == self.medium
        )
        return (
            None if (stress := next(stresses, None)) is None else stress * depth / DEPTH
        )

    def time_steps(
        self,
        alpha: ArrayLike,
        alphadot: ArrayLike,
        cycles: int | None,
        work: bool = False,
        path: bool = False,
    ) -> rft.TimeSteps:
        """Return the gait computed phase after phase (`rft.time_steps`), without checking convergence."""
        settings = {
            "cycles": cycles,
            "with_work": work,
            "with_path": path,
            **self._settings("tolerance", "backend"),
        }
        context = Swimmer.time_steps, self, alpha, alphadot, cycles is None

        def advance(
            stepping: Stepping, state: State, count: int, with_work: bool
        ) -> tuple[State, list[Row]]:
            step = partial(stepping.step, with_work=with_work)
            return iterate(step, state, count, (*context, with_work), Row)

        return rft.time_steps(
            self.medium, self.body, alpha, alphadot, advance=advance, **settings
        )

    def run(
        self,
        alpha: ArrayLike,
        alphadot: ArrayLike,
        work: bool = False,
        start: ArrayLike | None = None,
    ) -> Cycle:
        """Run a gait given by alpha, alphadot (..., N, joints) at N equally spaced phases, by the cheapest engine that
        is right. Balances begin from ``start`` as in `solve`, steps of time from the step before. RuntimeError if a
        force balance did not converge or cycles did not become periodic."""
        rates = alphadot.reshape(-1, self.joints).T
        speed = joint_speed(self.body, rates).reshape(alphadot.shape[:-1]).mean(-1)
        if not self.traits.steps:
            images = cycle_images(alpha, alphadot, self.traits)
            samples = (images.select(x) for x in (alpha, alphadot, start))
            solution = (
                self._for_gaits(speed.size, images.count).solve(*samples).checked()
            )
            xi = images.expand(solution.xi)
            work_done = (
                self._for_gaits(speed.size, alpha.shape[-2]).work(alpha, alphadot, xi)
                if work
                else None
            )
            return Cycle(
                xi,
                displacement(xi),
                solution.residual.max(-1),
                speed,
                work_done,
                1,
                0.0 * speed,
            )
        steps = self.time_steps(alpha, alphadot, self.solver.cycles, work).checked()
        net = displacement(steps.xi) if self._repeats(steps) else steps.displacement
        to_come = steps.drift if self.settling else 0.0 * speed
        return Cycle(
            steps.xi, net, steps.residual, speed, steps.work, steps.cycles, to_come
        )

    def _for_gaits(self, count: int, phases: int) -> Swimmer:
        """Return the swimmer for ``count`` gaits of ``phases`` phases each, where effects have a parameter for each
        gait."""
        effects = tuple(
            e.take(np.repeat(np.arange(count), phases)) for e in self.effects
        )
        unchanged = all(a is b for a, b in zip(effects, self.effects))
        return self if unchanged else dataclasses.replace(self, effects=effects)

    def _repeats(self, steps: rft.TimeSteps) -> bool:
        """Return whether cycles are equal: the velocity is then periodic, and its integral exact for the series through
        it."""
        return (
            not self.traits.lacks & Premise.SE2_SYMMETRIC
            and (steps.status == "periodic").all()
        )

    def path(
        self, alpha: ArrayLike, alphadot: ArrayLike, cycles: int = 1
    ) -> np.ndarray:
        """Return poses of the limit cycle; where cycles do not repeat, from the cycle that `run` returns."""
        before = (self.solver.cycles or 1) - 1
        if not self.traits.lacks & Premise.SE2_SYMMETRIC:
            steps = self.time_steps(alpha, alphadot, self.solver.cycles).checked()
            if self._repeats(steps):
                return repeated(poses(steps.xi), cycles)
        steps = self.time_steps(alpha, alphadot, before + cycles, path=True).checked()
        poses_after = steps.path[before * len(alpha) :]
        return se2.compose(se2.inverse(poses_after[:1]), poses_after)

    def refined(self) -> Swimmer | None:
        rule, count = rule_for(self.medium, self.solver.loads)
        finer = (
            {}
            if rule == "exact"
            else {"loads": "exact" if self.closed else f"{rule}:{min(2 * count, 1000)}"}
        )
        if not self.traits.linear:
            finer["regularisation"] = max(self.solver.regularisation / 10, 1e-12)
        return (
            self.with_solver(dataclasses.replace(self.solver, **finer))
            if finer
            else None
        )

    @classmethod
    def examples(cls) -> dict[str, Swimmer]:
        return {
            "swimmer": cls(
                MEDIA["glass-0.3mm-loose"],
                rft.Chain((0.7, 1.4, 0.9), frame="link-1", length=0.3),
            )
        }


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
        fractions = getattr(body, "fractions", np.array([0.25]))
        low, what = (0.02, "link") if hasattr(body, "fractions") else (0.008, "body")
        ends = (effect.tail, fractions[0]), (effect.head, fractions[-1])
        links = [fraction for e, fraction in ends if e > 0]
        if radius == 0 or not links:
            continue
        size, unit = 1.0, "body lengths"
        if body.length is not None:
            size, unit = 1e3 * body.length, "mm"
        if not low * max(links) <= radius <= min(links):
            link = min(links) if radius > min(links) else max(links)
            length = size * link if what == "link" else size
            warnings.warn(
                f"end-caps have a radius of {size * radius:.3g} {unit}, on a {what} of "
                f"{length:.3g} {unit}: is it in another unit?",
                UnitWarning,
                stacklevel=4,
            )


def _has_joint_angles(body: rft.Body) -> bool:
    """Return whether shape variables are angles of joints; bodies with few have amplitudes of bends, or of modes,
    instead."""
    plain = (
        isinstance(body, (rft.Chain, rft.Backbone))
        and getattr(body, "bends", None) is None
    )
    return plain and getattr(body, "modes", None) is None


def is_three_link(system: System) -> bool:
    """Return whether a system is the three-link swimmer, for which the published gaits were made."""
    body = system.body if isinstance(system, Swimmer) else None
    return isinstance(body, rft.Chain) and len(body.lengths) == 3 and body.modes is None


def name_in(kinds: dict, part) -> str:
    """Return the name of a part in ``kinds``, or that of its class."""
    return next(
        (name for name, kind in kinds.items() if type(part) is kind),
        type(part).__name__,
    )
