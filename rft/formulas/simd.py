"""The functions of `rft.formulas.vectors` inside compiled code, on numbers and on eight
numbers at once.

A `Vector` is eight doubles in a register, a `Mask` eight truth values; LLVM splits them
where a processor's registers are narrower. A formula of one element, compiled for
vectors, computes eight elements in the time of one. Importing this module loads numba,
which takes some 0.2 s."""

from __future__ import annotations

import math
import operator

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.imputils import lower_cast
from numba.core.typeconv import Conversion
from numba.core.typing import signature
from numba.extending import (
    intrinsic,
    lower_builtin,
    models,
    overload,
    overload_method,
    register_jitable,
    register_model,
    type_callable,
)

from rft.formulas import vectors

WIDTH = 8
DOUBLES, INTEGERS, BITS = (
    ir.VectorType(kind, WIDTH)
    for kind in (ir.DoubleType(), ir.IntType(64), ir.IntType(1))
)


class Vector(types.Type):
    """Eight doubles; a number converts to eight equal ones."""

    def can_convert_from(self, context, other):
        return (
            Conversion.safe if isinstance(other, (types.Float, types.Integer)) else None
        )


class Mask(types.Type):
    """Eight truth values; a single one converts to eight equal ones."""

    def can_convert_from(self, context, other):
        return Conversion.safe if isinstance(other, types.Boolean) else None


vector = Vector("vector")
mask = Mask("mask")


def _register_model(kind, llvm):
    @register_model(kind)
    class Model(models.PrimitiveModel):
        def __init__(self, manager, fe_type):
            super().__init__(manager, fe_type, llvm)


_register_model(Vector, DOUBLES)
_register_model(Mask, BITS)


def _repeated(builder, x, llvm):
    """Return a vector of eight copies of a value."""
    one = builder.insert_element(ir.Constant(llvm, ir.Undefined), x, ir.IntType(32)(0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), None)
    return builder.shuffle_vector(one, ir.Constant(llvm, ir.Undefined), zeros)


@lower_cast(types.Float, Vector)
@lower_cast(types.Integer, Vector)
def _vector_from_number(context, builder, fromty, toty, x):
    return _repeated(builder, context.cast(builder, x, fromty, types.float64), DOUBLES)


@lower_cast(types.Boolean, Mask)
def _mask_from_truth(context, builder, fromty, toty, x):
    return _repeated(builder, context.cast(builder, x, fromty, types.boolean), BITS)


# Operators.


def _takes_vectors(a, b):
    return vector in (a, b) and all(
        isinstance(x, (Vector, types.Number)) for x in (a, b)
    )


def _takes_masks(a, b):
    return mask in (a, b) and all(isinstance(x, (Mask, types.Boolean)) for x in (a, b))


def _define_operator(function, takes, argument, result, emit):
    """Define a binary operator for arguments of one type."""

    @type_callable(function)
    def typed(context):
        return lambda a, b: (
            signature(result, argument, argument) if takes(a, b) else None
        )

    lower_builtin(function, argument, argument)(
        lambda context, builder, sig, args: emit(builder, *args)
    )


def _arithmetic(name):
    return lambda builder, x, y: getattr(builder, name)(x, y, flags=("contract",))


def _comparison(sign):
    return lambda builder, x, y: builder.fcmp_ordered(sign, x, y)


for _function, _name in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _define_operator(_function, _takes_vectors, vector, vector, _arithmetic(_name))
for _function, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
):
    _define_operator(_function, _takes_vectors, vector, mask, _comparison(_sign))
_define_operator(
    operator.and_, _takes_masks, mask, mask, lambda builder, x, y: builder.and_(x, y)
)
_define_operator(
    operator.or_, _takes_masks, mask, mask, lambda builder, x, y: builder.or_(x, y)
)


@type_callable(operator.neg)
def _type_of_negative(context):
    return lambda a: signature(vector, vector) if a == vector else None


@lower_builtin(operator.neg, vector)
def _negative(context, builder, sig, args):
    return builder.fneg(args[0])


# Functions.


def _intrinsic(name, count):
    """Return a function that emits a call of LLVM's intrinsic of this name with
    ``count`` arguments."""

    def emit(builder, *args):
        full = f"llvm.{name}.v{WIDTH}f64"
        module = builder.module
        kind = ir.FunctionType(DOUBLES, [DOUBLES] * count)
        return builder.call(
            module.globals.get(full) or ir.Function(module, kind, full), args
        )

    return emit


def _selected(sign):
    return lambda builder, x, y: builder.select(builder.fcmp_ordered(sign, x, y), x, y)


def _define(function, takes, emit, number):
    """Define a function of `rft.formulas.vectors` in compiled code: for vectors by
    ``emit``, for numbers as the function ``number``."""
    result = signature(vector, *takes)

    def typed(*args):
        return result if vector in args or mask in args else None

    # numba reads the number of arguments from the signature of these functions.
    typers = (
        lambda x: typed(x),
        lambda x, y: typed(x, y),
        lambda x, y, z: typed(x, y, z),
    )
    type_callable(function)(lambda context: typers[len(takes) - 1])
    lower_builtin(function, *takes)(
        lambda context, builder, sig, args: emit(builder, *args)
    )
    for_numbers = (
        lambda x: number if isinstance(x, types.Number) else None,
        lambda x, y: (
            number
            if isinstance(x, types.Number) and isinstance(y, types.Number)
            else None
        ),
        lambda condition, x, y: (
            number if isinstance(condition, types.Boolean) else None
        ),
    )
    overload(function, strict=False)(for_numbers[len(takes) - 1])


_define(vectors.sqrt, (vector,), _intrinsic("sqrt", 1), lambda x: np.sqrt(x))
_define(vectors.absolute, (vector,), _intrinsic("fabs", 1), lambda x: abs(x))
_define(vectors.floor, (vector,), _intrinsic("floor", 1), lambda x: np.floor(x))
_define(
    vectors.copysign,
    (vector, vector),
    _intrinsic("copysign", 2),
    lambda x, y: np.copysign(x, y),
)
_define(
    vectors.maximum, (vector, vector), _selected(">"), lambda x, y: x if x > y else y
)
_define(
    vectors.minimum, (vector, vector), _selected("<"), lambda x, y: x if x < y else y
)
_define(
    vectors.where,
    (mask, vector, vector),
    lambda builder, c, x, y: builder.select(c, x, y),
    lambda condition, x, y: x if condition else y,
)


@intrinsic
def _exponents(context, x):
    """Return the exponents of 2 and the mantissas, in [1, 2), of eight numbers."""

    def constant(n):
        return ir.Constant(INTEGERS, [n] * WIDTH)

    def emit(context, builder, sig, args):
        bits = builder.bitcast(args[0], INTEGERS)
        power = builder.sub(builder.lshr(bits, constant(52)), constant(1023))
        mantissa = builder.or_(
            builder.and_(bits, constant((1 << 52) - 1)), constant(1023 << 52)
        )
        pair = builder.sitofp(power, DOUBLES), builder.bitcast(mantissa, DOUBLES)
        return context.make_tuple(builder, sig.return_type, pair)

    return types.UniTuple(vector, 2)(vector), emit


LN2 = float(np.log(2.0))
# Coefficients of s^2, s^4 ... in atanh s = s (1 + s^2 / 3 + ...), to roundoff for |s| <
# 0.172.
ATANH = tuple(1.0 / (2 * j + 1) for j in range(1, 12))


@overload(vectors.log_ratio, inline="never", jit_options={"forceinline": True})
def _log_ratio(a, b):
    if isinstance(a, types.Number):
        return lambda a, b: np.log(a / b)

    def log_ratio(a, b):
        power_a, a = _exponents(a)
        power_b, b = _exponents(b)
        large = a > 1.4142135623730951 * b
        small = b > 1.4142135623730951 * a
        a = a * vectors.where(large, 0.5, 1.0)
        b = b * vectors.where(small, 0.5, 1.0)
        power = (
            power_a
            - power_b
            + vectors.where(large, 1.0, 0.0)
            - vectors.where(small, 1.0, 0.0)
        )
        s = (a - b) / (a + b)
        z = s * s
        return LN2 * power + (s + s) * (1.0 + z * vectors.polynomial(z, ATANH))

    return log_ratio


@intrinsic
def _times_power_of_two(context, x, shifted):
    """Return x 2^k for eight integers k between -1022 and 1023, given as ROUND + k."""

    def emit(context, builder, sig, args):
        power = builder.shl(
            builder.bitcast(args[1], INTEGERS), ir.Constant(INTEGERS, [52] * WIDTH)
        )
        bits = builder.add(builder.bitcast(args[0], INTEGERS), power)
        return builder.bitcast(bits, DOUBLES)

    return vector(x, shifted), emit


# ln 2 in two parts, of which the first has so few digits that k times it is exact.
LN2_HIGH = float.fromhex("0x1.62e42fefap-1")
LN2_LOW = float.fromhex("0x1.cf79abc9e3b3ap-40")
# Of numbers this large the last binary digit is 1, so that adding it rounds.
ROUND = 1.5 * 2.0**52
LEAST_EXPONENT = -708.0  # below which the exponential function is taken as 0
LARGEST_EXPONENT = 709.0
# Coefficients of exp r to roundoff for |r| < ln 2 / 2.
EXP = tuple(1.0 / math.factorial(j) for j in range(14))


@overload(vectors.exp, inline="never", jit_options={"forceinline": True})
def _exp(x):
    if isinstance(x, types.Number):
        return lambda x: np.exp(x)

    def exp(x):
        inside = vectors.where(x < LEAST_EXPONENT, LEAST_EXPONENT, x)
        inside = vectors.where(x > LARGEST_EXPONENT, LARGEST_EXPONENT, inside)
        shifted = inside * (1.0 / LN2) + ROUND
        k = shifted - ROUND
        r = (inside - k * LN2_HIGH) - k * LN2_LOW
        power = _times_power_of_two(vectors.polynomial(r, EXP), shifted)
        power = vectors.where(x < LEAST_EXPONENT, 0.0, power)
        return vectors.where(x > LARGEST_EXPONENT, np.inf, power)

    return exp


@overload(vectors.polynomial, inline="never", jit_options={"forceinline": True})
def _polynomial(z, coefficients):
    """Return Horner's rule without a loop, for numba would not unroll a loop over a
    tuple."""
    count = len(coefficients)
    lines = [
        f"    value = value * z + coefficients[{j}]" for j in range(count - 2, -1, -1)
    ]
    return _function_from_source(
        "unrolled",
        [
            "z, coefficients",
            f"    value = coefficients[{count - 1}]",
            *lines,
            "    return value",
        ],
    )


@overload(vectors.combinations, inline="never", jit_options={"forceinline": True})
def _combinations(coefficients, terms):
    """Return the sums without loops, for numba would not unroll loops over tuples."""

    def row(i):
        products = [f"c[{i}][{j + 1}] * t[{j}]" for j in range(len(terms))]
        return " + ".join([f"c[{i}][0]", *products])

    sums = ", ".join(row(i) for i in range(len(coefficients)))
    return _function_from_source(
        "unrolled",
        [
            "coefficients, terms",
            "    c, t = coefficients, terms",
            f"    return ({sums},)",
        ],
    )


def _function_from_source(name: str, lines: list[str], **names):
    """Return the function of this name from its source, arguments followed by the lines
    of its body, with ``names`` for globals."""
    namespace = dict(names)
    exec("\n".join([f"def {name}({lines[0]}):", *lines[1:]]), namespace)
    return namespace[name]


# Memory: vectors are stored in the rows of arrays of eight columns.


@intrinsic
def load(context, x, i):
    """Return the vector x[i, :] of an array (n, 8)."""

    def emit(context, builder, sig, args):
        return builder.load(_pointer(context, builder, sig, args), align=8)

    return vector(x, i), emit


@intrinsic
def store(context, x, i, value):
    """Write a vector to x[i, :] of an array (n, 8)."""

    def emit(context, builder, sig, args):
        builder.store(args[2], _pointer(context, builder, sig, args), align=8)
        return context.get_dummy_value()

    return types.void(x, i, vector), emit


@intrinsic
def add_vector(context, x, i, value):
    """Add a vector to x[i, :] of an array (n, 8), each of its numbers rounded as it
    is."""

    def emit(context, builder, sig, args):
        row = _pointer(context, builder, sig, args)
        builder.store(builder.fadd(builder.load(row, align=8), args[2]), row, align=8)
        return context.get_dummy_value()

    return types.void(x, i, vector), emit


@intrinsic
def add_lanes(context, x, i, value):
    """Add the eight numbers of a vector to x[i, 0], one after the other."""

    def emit(context, builder, sig, args):
        double = ir.DoubleType()
        first = builder.bitcast(
            _pointer(context, builder, sig, args), double.as_pointer()
        )
        name = f"llvm.vector.reduce.fadd.v{WIDTH}f64"
        module = builder.module
        kind = ir.FunctionType(double, [double, DOUBLES])
        add = module.globals.get(name) or ir.Function(module, kind, name)
        builder.store(builder.call(add, [builder.load(first), args[2]]), first)
        return context.get_dummy_value()

    return types.void(x, i, vector), emit


def _pointer(context, builder, sig, args):
    array = context.make_array(sig.args[0])(context, builder, args[0])
    row = builder.mul(
        context.cast(builder, args[1], sig.args[1], types.int64), ir.IntType(64)(WIDTH)
    )
    return builder.bitcast(builder.gep(array.data, [row]), DOUBLES.as_pointer())


@intrinsic
def sum_of(context, x):
    """Return the sum of the eight numbers of a vector, pair by pair."""

    def emit(context, builder, sig, args):
        lanes = [
            builder.extract_element(args[0], ir.IntType(32)(lane))
            for lane in range(WIDTH)
        ]
        while len(lanes) > 1:
            lanes = [builder.fadd(a, b) for a, b in zip(lanes[::2], lanes[1::2])]
        return lanes[0]

    return types.float64(x), emit


@intrinsic
def any_of(context, x):
    """Return whether any of eight truth values holds."""

    def emit(context, builder, sig, args):
        bits = ir.IntType(WIDTH)
        return builder.icmp_unsigned("!=", builder.bitcast(args[0], bits), bits(0))

    return types.boolean(x), emit


@overload(vectors.anywhere)
def _anywhere(condition):
    if condition == mask:
        return lambda condition: any_of(condition)
    return lambda condition: condition


@intrinsic
def _gather(context, table, row, column):
    """Return table[row, column] of an array (n, m) for a vector of eight integers
    ``row``."""

    def emit(context, builder, sig, args):
        array = context.make_array(sig.args[0])(context, builder, args[0])
        columns = builder.extract_value(array.shape, 1)
        rows = builder.fptosi(args[1], INTEGERS)
        column = context.cast(builder, args[2], sig.args[2], types.int64)
        value = ir.Constant(DOUBLES, ir.Undefined)
        for lane in map(ir.IntType(32), range(WIDTH)):
            offset = builder.add(
                builder.mul(builder.extract_element(rows, lane), columns), column
            )
            value = builder.insert_element(
                value, builder.load(builder.gep(array.data, [offset])), lane
            )
        return value

    return vector(table, row, column), emit


@overload(vectors.gather)
def _gather_overload(table, row, column):
    if row == vector:
        return lambda table, row, column: _gather(table, row, column)
    return lambda table, row, column: table[int(row), column]


def record_access(kind):
    """Return read(x, first) and write(x, first, record) of a NamedTuple of vectors that
    is stored in the rows of an array x (rows, 8) from the row ``first`` on."""
    reads = ", ".join(f"load(x, first + {i})" for i in range(len(kind._fields)))
    writes = [
        f"    store(x, first + {i}, record.{name})"
        for i, name in enumerate(kind._fields)
    ]
    read = _function_from_source(
        "read", ["x, first", f"    return kind({reads})"], kind=kind, load=load
    )
    write = _function_from_source("write", ["x, first, record", *writes], store=store)
    return register_jitable(forceinline=True)(read), register_jitable(forceinline=True)(
        write
    )


def of_one_element(formula, count: int):
    """Return f(arguments, e, i), a formula of the entries (e, i) of ``count`` arrays
    (n, B), of which a single row or column stands for all."""
    entries = ", ".join(f"entry(arguments[{j}], e, i)" for j in range(count))
    function = _function_from_source(
        "of_one_element",
        ["arguments, e, i", f"    return formula({entries})"],
        formula=formula,
        entry=_entry,
    )
    return register_jitable(forceinline=True)(function)


@register_jitable(forceinline=True)
def _entry(x, e, i):
    return x[min(e, x.shape[0] - 1), min(i, x.shape[1] - 1)]


@overload(vectors.over_nodes, inline="never")
def _over_nodes(load):
    return lambda load: load


# Formulas.


def register_formulas() -> None:
    """Register with numba all formulas that were marked since the last call."""
    while vectors.FORMULAS:
        register_jitable(inline="never", forceinline=True)(vectors.FORMULAS.pop(0))


def _register_method(name: str, count: int) -> None:
    """Let compiled code call the formula ``name`` of a law's class, with ``count``
    arguments beside the law."""
    arguments = ", ".join(f"x{i}" for i in range(count))

    def implementation(law):
        return _function_from_source(
            "call",
            [f"law, {arguments}", f"    return method(law, {arguments})"],
            method=getattr(law.instance_class, name),
        )

    typed = _function_from_source(
        "typed",
        [f"law, {arguments}", "    return implementation(law)"],
        implementation=implementation,
    )
    for kind in (types.NamedTuple, types.NamedUniTuple):
        overload_method(kind, name, jit_options={"forceinline": True})(typed)


_register_method("traction", 3)
_register_method("slopes", 3)
_register_method("average", 4)
_register_method("alpha_ahead", 2)
_register_method("traction_slope", 4)
_register_method("lead", 3)
_register_method("lead_slope", 3)
