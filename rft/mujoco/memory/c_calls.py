"""Memory and C functions at addresses, for compiled code. Importing this module loads
numba."""

from __future__ import annotations

import sys

import numpy as np
from llvmlite import ir
from numba import carray, types
from numba.core import sigutils
from numba.core.ccallback import CFunc
from numba.extending import intrinsic, register_jitable

from rft.balance.cache import Cache

OPTIONS = {"nopython": True, "nogil": True, "error_model": "numpy"}


@intrinsic
def pointer_to(context, address):
    """Return an address as a pointer."""

    def emit(context, builder, sig, args):
        return builder.inttoptr(args[0], context.get_value_type(types.voidptr))

    return types.voidptr(types.int64), emit


@intrinsic
def address_of(context, pointer):
    """Return a pointer as an address."""

    def emit(context, builder, sig, args):
        return builder.ptrtoint(args[0], ir.IntType(64))

    return types.int64(types.voidptr), emit


@intrinsic
def call(context, function, arguments):
    """Call the C function at an address, which returns nothing, with a tuple of
    pointers and numbers."""

    def emit(context, builder, sig, args):
        kinds = [context.get_value_type(kind) for kind in sig.args[1].types]
        kind = ir.FunctionType(ir.VoidType(), kinds)
        called = builder.inttoptr(args[0], kind.as_pointer())
        values = [builder.extract_value(args[1], i) for i in range(len(kinds))]
        builder.call(called, values)
        return context.get_dummy_value()

    return types.void(function, arguments), emit


@register_jitable
def numbers_at(address, shape):
    """Return the array of numbers of a shape at an address."""
    return carray(pointer_to(address), shape, np.float64)


@register_jitable
def integers_at(address, shape):
    """Return the array of 64-bit integers of a shape at an address."""
    return carray(pointer_to(address), shape, np.int64)


@register_jitable
def short_integers_at(address, shape):
    """Return the array of 32-bit integers of a shape at an address."""
    return carray(pointer_to(address), shape, np.int32)


def compiled_c(function, arguments: tuple, purpose: str, *modules) -> CFunc:
    """Return a C function of arguments of these types, stored on disk; print one line
    if it has yet to be compiled.

    modules: those whose source counts for what is stored
    (`rft.balance.cache.digest`)."""
    signature = sigutils.normalize_signature(types.void(*arguments))
    compiled = CFunc(function, signature, {}, OPTIONS)
    if purpose:
        compiled._cache = Cache(function, *modules)
        if not compiled._cache.path.exists():
            print(f"compiling {purpose} (once, a few seconds)", file=sys.stderr)
    compiled.compile()
    return compiled
