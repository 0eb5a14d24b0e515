"""Sums of sines and cosines as rational functions of z_k = exp(i alpha_k / q), in
lowest terms.

A function that is even in alpha has rational coefficients, and an odd function is i
times such a function. So common factors of numerator and denominator are found over the
rational numbers, in a tenth of a second; over complex numbers it takes a minute."""

from __future__ import annotations

import math
from typing import Any

import sympy as sp

LARGEST_PART = 2  # z = exp(i alpha / q) up to this q makes no high powers
MULTIPLES = sorted(range(-8, 9), key=abs)  # of the heading in one angle
Value = tuple[Any, int]  # a function, and 1 if it is multiplied by i, else 0


class NotRational(ValueError):
    """The expression is no rational function of sines and cosines, or neither even nor
    odd."""


class Waves:
    """The functions of which a matrix consists.

    Angles are sums of whole multiples of ``shares``, which are alpha or parts of it,
    and of ``heading``, the heading of a mean frame: its own parts of alpha would make
    high powers."""

    def __init__(self, A: sp.Matrix, alpha):
        self.alpha = tuple(alpha)
        arguments = {w.args[0] for w in A.atoms(sp.sin, sp.cos)}
        angles = sorted(arguments, key=lambda x: (len(str(x)), str(x)))
        q = self._common_denominator(angles)
        self.heading = sp.Integer(0)
        self.shares = [a / min(q, LARGEST_PART) for a in self.alpha]
        if q > LARGEST_PART:
            fitting = [x for x in angles if all(self.multiples(y, x) for y in angles)]
            if fitting:
                self.heading = fitting[0]
            else:
                self.shares = [a / q for a in self.alpha]
        self.units = [*self.shares, self.heading]

        names = sp.symbols(f"z_1:{len(self.units) + 1}")
        parameters = sorted(A.free_symbols - {*self.alpha}, key=str)
        self.field = sp.QQ.frac_field(*names, *parameters)
        self.z = self.field.gens[: len(names)]
        self.symbols = self.field.symbols[len(names) :]
        self.cache: dict[Any, Value] = {}

    def _common_denominator(self, angles) -> int:
        """Return the q for which all rational coefficients of alpha in the angles are
        whole multiples of 1/q."""
        q = 1
        for angle in angles:
            for coefficient in map(angle.coeff, self.alpha):
                if coefficient.is_Rational:
                    q = math.lcm(q, int(coefficient.q))
        return q

    def multiples(self, angle, heading) -> list[int] | None:
        """Return how many of each share, and of the heading, add up to the angle; None
        if no whole numbers do."""
        candidates = MULTIPLES if heading else [0]
        for turns in candidates:
            remainder = sp.expand(angle - turns * heading)
            powers = []
            total = sp.Integer(0)
            for a, share in zip(self.alpha, self.shares):
                power = remainder.coeff(a) / share.coeff(a)
                powers.append(power)
                total += power * share
            are_whole = all(power.is_Integer for power in powers)
            if are_whole and sp.expand(remainder - total) == 0:
                return [*map(int, powers), turns]
        return None

    def reduced(self, entry) -> sp.Expr:
        """Return the entry in lowest terms, or unchanged."""
        try:
            return self.as_sympy(*self.value(entry))
        except NotRational:
            return entry

    def value(self, e) -> Value:
        """Return an expression as a value; NotRational if it is none."""
        if e not in self.cache:
            self.cache[e] = self._value(e)
        return self.cache[e]

    def _value(self, e) -> Value:
        """Return `value`, computed."""
        if e.is_Add:
            return self._sum_of_values(e.args)
        if e.is_Mul:
            return self.product(map(self.value, e.args))
        if e.is_Pow and e.exp.is_Integer:
            base, odd = self.value(e.base)
            if e.exp < 0:
                base = 1 / base
                if odd:
                    base = -base  # 1 / i = -i
            return self.product([(base, odd)] * abs(int(e.exp)))
        if isinstance(e, sp.cos):
            z = self.wave(e.args[0])
            return (z + 1 / z) / 2, 0
        if isinstance(e, sp.sin):
            z = self.wave(e.args[0])
            return (1 / z - z) / 2, 1  # times i
        if e.is_Rational or (e.is_Symbol and e not in self.alpha):
            return self.field.from_sympy(e), 0
        raise NotRational

    def _sum_of_values(self, terms) -> Value:
        """Return the value of a sum; NotRational for a sum of even and odd
        functions."""
        total = self.field.zero
        odd = None
        for term in terms:
            value, term_odd = self.value(term)
            if not value:
                continue
            if odd not in (None, term_odd):
                raise NotRational
            total += value
            odd = term_odd
        return total, odd or 0

    def product(self, values) -> Value:
        """Return the product of values."""
        total = self.field.one
        odd = 0
        for value, value_odd in values:
            total = total * value
            if odd and value_odd:
                total = -total  # i * i = -1
            odd ^= value_odd
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
        number, product, powers_of_i = self.factors(value.numer)
        number_below, product_below, powers_below = self.factors(value.denom)
        quarter_turns = (odd + powers_of_i - powers_below) % 4
        if quarter_turns % 2:
            raise NotRational
        if quarter_turns == 2:
            number = -number
        return number / number_below * (product / product_below)

    def factors(self, poly) -> tuple[Any, Any, int]:
        """Return a polynomial, over the monomial in its middle, as (a number, a product
        of powers of sums, the power of i)."""
        content, powers = poly.sqf_list()
        number = self.field.domain.to_sympy(content)
        product = sp.Integer(1)
        powers_of_i = 0
        for factor, power in powers:
            summed, odd = self.sum(factor)
            content, summed = summed.primitive()
            number = number * content**power
            product = product * summed**power
            powers_of_i += odd * power
        return number, product, powers_of_i

    def sum(self, poly) -> Value:
        """Return a polynomial, over the monomial in its middle, as a sum of cosines, or
        as i times a sum of sines."""
        terms = self._terms(poly)
        twice_middle = [min(k) + max(k) for k in zip(*terms)]
        total = sp.Integer(0)
        kinds = set()
        for powers, c in terms.items():
            opposite = tuple(m - k for m, k in zip(twice_middle, powers))
            mirrored = terms.get(opposite, 0)
            angle = sp.Integer(0)
            for k, m, unit in zip(powers, twice_middle, self.units):
                angle += sp.Rational(2 * k - m, 2) * unit
            angle = sp.expand(angle)

            if sp.expand(c - mirrored) == 0:
                kinds.add(sp.cos)
                total += c * sp.cos(angle)
            elif sp.expand(c + mirrored) == 0:
                kinds.add(sp.sin)
                total += c * sp.sin(angle)
            else:
                raise NotRational
        if len(kinds) > 1:
            raise NotRational
        return total, int(kinds == {sp.sin})

    def _terms(self, poly) -> dict[tuple[int, ...], Any]:
        """Return the coefficients of a polynomial by the powers of z; they are
        polynomials in the other symbols."""
        terms: dict[tuple[int, ...], Any] = {}
        n = len(self.units)
        for powers, c in poly.terms():
            factors = [s**p for s, p in zip(self.symbols, powers[n:])]
            term = sp.Mul(self.field.domain.to_sympy(c), *factors)
            terms[powers[:n]] = terms.get(powers[:n], 0) + term
        return terms
