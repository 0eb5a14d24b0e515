"""Sums of sines and cosines as rational functions of z_k = exp(i alpha_k / q), in lowest terms.

A function that is even in alpha has rational coefficients, and one that is odd is i times such a function. So factors
common to both parts of a fraction are found over the rational numbers, in a tenth of a second; over complex ones it
takes a minute.
"""

from __future__ import annotations

import math
from typing import Any

import sympy as sp

MOST = 2  # parts of alpha that are no high powers yet
MULTIPLES = sorted(range(-8, 9), key=abs)  # of the heading in one angle


class NotRational(ValueError):
    """The expression is no rational function of sines and cosines, or neither even nor odd."""


class Waves:
    """The functions of which a matrix consists. A value is (function, 1 if it is to be multiplied by i, else 0).

    Angles are sums of whole multiples of ``shares``, those of alpha, or parts of them, and of ``heading``, that of a mean
    frame: its own parts of alpha would make high powers.
    """

    def __init__(self, A: sp.Matrix, alpha):
        self.alpha = tuple(alpha)
        angles = sorted(
            {w.args[0] for w in A.atoms(sp.sin, sp.cos)},
            key=lambda x: (len(str(x)), str(x)),
        )
        q = math.lcm(
            1,
            *(
                int(x.q)
                for angle in angles
                for x in map(angle.coeff, self.alpha)
                if x.is_Rational
            ),
        )
        self.shares, self.heading = (
            [a / (q if q <= MOST else 2) for a in self.alpha],
            sp.Integer(0),
        )
        if q > MOST:
            fitting = [x for x in angles if all(self.multiples(y, x) for y in angles)]
            self.heading = fitting[0] if fitting else self.heading
            self.shares = self.shares if fitting else [a / q for a in self.alpha]
        self.units = [*self.shares, self.heading]
        names = sp.symbols(f"z_1:{len(self.units) + 1}")
        self.field = sp.QQ.frac_field(
            *names, *sorted(A.free_symbols - {*self.alpha}, key=str)
        )
        self.z, self.symbols = (
            self.field.gens[: len(names)],
            self.field.symbols[len(names) :],
        )
        self.cache: dict[Any, tuple[Any, int]] = {}

    def multiples(self, angle, heading) -> list[int] | None:
        """Return how many of each share, and of the heading, add up to the angle; None if no whole numbers do."""
        for turns in MULTIPLES if heading else (0,):
            remainder = sp.expand(angle - turns * heading)
            powers = [
                remainder.coeff(a) / share.coeff(a)
                for a, share in zip(self.alpha, self.shares)
            ]
            integers = all(x.is_Integer for x in powers)
            if (
                integers
                and sp.expand(
                    remainder - sum(k * share for k, share in zip(powers, self.shares))
                )
                == 0
            ):
                return [*map(int, powers), turns]
        return None

    def reduced(self, entry) -> sp.Expr:
        """Return the entry in lowest terms, or unchanged."""
        try:
            return self.as_sympy(*self.value(entry))
        except NotRational:
            return entry

    def value(self, e) -> tuple[Any, int]:
        if e not in self.cache:
            self.cache[e] = self._value(e)
        return self.cache[e]

    def _value(self, e) -> tuple[Any, int]:
        if e.is_Add:
            parts = [x for x in map(self.value, e.args) if x[0]]
            if len({odd for _, odd in parts}) > 1:
                raise NotRational
            return sum((x for x, _ in parts), self.field.zero), parts[0][
                1
            ] if parts else 0
        if e.is_Mul:
            return self.product(map(self.value, e.args))
        if e.is_Pow and e.exp.is_Integer:
            base, odd = self.value(e.base)
            if e.exp < 0:
                base = (-1 if odd else 1) / base  # 1 / i = -i
            return self.product([(base, odd)] * abs(int(e.exp)))
        if isinstance(e, (sp.sin, sp.cos)):
            z = self.wave(e.args[0])
            return (
                ((z + 1 / z) / 2, 0) if isinstance(e, sp.cos) else ((1 / z - z) / 2, 1)
            )
        if e.is_Rational or (e.is_Symbol and e not in self.alpha):
            return self.field.from_sympy(e), 0
        raise NotRational

    def product(self, values) -> tuple[Any, int]:
        total, odd = self.field.one, 0
        for x, factor_odd in values:
            total = -total * x if odd and factor_odd else total * x
            odd ^= factor_odd
        return total, odd

    def wave(self, angle) -> Any:
        """Return exp(i angle)."""
        powers = self.multiples(angle, self.heading)
        if powers is None:
            raise NotRational
        return math.prod((z**k for z, k in zip(self.z, powers)), start=self.field.one)

    def as_sympy(self, value, odd: int) -> sp.Expr:
        """Return the value as a fraction of products of sums of sines and cosines."""
        if not value:
            return sp.Integer(0)
        (above, top, turns), (below, bottom, turns_below) = map(
            self.factors, (value.numer, value.denom)
        )
        quarter = (odd + turns - turns_below) % 4
        if quarter % 2:
            raise NotRational
        return (-above if quarter else above) / below * (top / bottom)

    def factors(self, poly) -> tuple[Any, Any, int]:
        """Return a polynomial, over the monomial in its middle, as (a number, a product of powers of sums, the power of
        i)."""
        content, powers = poly.sqf_list()
        number, product, turns = self.field.domain.to_sympy(content), sp.Integer(1), 0
        for factor, power in powers:
            summed, odd = self.sum(factor)
            part, summed = summed.primitive()
            number, product, turns = (
                number * part**power,
                product * summed**power,
                turns + odd * power,
            )
        return number, product, turns

    def sum(self, poly) -> tuple[Any, int]:
        """Return a polynomial, over the monomial in its middle, as a sum of cosines, or as i times one of sines: (sum,
        1 if so)."""
        terms: dict[tuple[int, ...], Any] = {}
        n = len(self.units)
        for powers, c in poly.terms():
            term = sp.Mul(
                self.field.domain.to_sympy(c),
                *(s**p for s, p in zip(self.symbols, powers[n:])),
            )
            terms[powers[:n]] = terms.get(powers[:n], 0) + term
        middle = [min(k) + max(k) for k in zip(*terms)]  # twice the middle
        total, kinds = sp.Integer(0), set()
        for k, c in terms.items():
            mirrored = terms.get(tuple(m - x for m, x in zip(middle, k)), 0)
            angle = sum(
                (
                    sp.Rational(2 * x - m, 2) * a
                    for x, m, a in zip(k, middle, self.units)
                ),
                sp.Integer(0),
            )
            sign = 1 if sp.expand(c - mirrored) == 0 else -1
            if sp.expand(c - sign * mirrored) != 0:
                raise NotRational
            total += c * (
                sp.cos(sp.expand(angle)) if sign == 1 else sp.sin(sp.expand(angle))
            )
            kinds.add(sign)
        if len(kinds) > 1:
            raise NotRational
        return total, int(kinds == {-1})
