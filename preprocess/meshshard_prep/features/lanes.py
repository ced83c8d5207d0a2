"""LANES complex numbers at a time, as vector instructions.

An array of lanes is (rows, 2, LANES) float64: real parts, imaginary parts. A row is one number for each of LANES
systems that differ in their shift alone, so the systems go through every loop together. Written as loops over lanes,
compilers guard each against arrays that overlap, which costs more than the arithmetic.
"""

import inspect
from typing import Any

import numpy as np
from jaxtyping import Float64
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

LANES = 8
"""Two cache lines for real parts and imaginary parts, and one AVX-512 register each; others take two or four."""

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_FUSED = ("contract",)
"""Multiplications and additions may become one instruction, with one rounding."""


def lane_rows(count: int) -> Float64[np.ndarray, "{count} 2 8"]:
    """Uninitialised rows, each on its own cache lines: across two of them, loads take twice the time."""
    size = count * 2 * LANES
    memory = np.empty(size + LANES)
    first = (-memory.ctypes.data % 64) // 8
    return memory[first : first + size].reshape(count, 2, LANES)


def _pointers(context: Any, builder: Any, array_type: Any, array: Any, index: Any) -> list[Any]:
    """To the real and the imaginary parts of one row of an array of lanes."""
    vectors = builder.bitcast(context.make_array(array_type)(context, builder, array).data, _VECTOR.as_pointer())
    real = builder.shl(index, ir.Constant(index.type, 1))
    return [builder.gep(vectors, [real]), builder.gep(vectors, [builder.add(real, ir.Constant(index.type, 1))])]


def _load(builder: Any, pointers: list[Any]) -> list[Any]:
    return [builder.load(pointer, align=8) for pointer in pointers]


def _store(builder: Any, values: list[Any], pointers: list[Any]) -> None:
    for value, pointer in zip(values, pointers, strict=True):
        builder.store(value, pointer, align=8)


def _fused(builder: Any, into: Any, sign: int, a: Any, b: Any) -> Any:
    """into + sign * a * b."""
    combine = builder.fadd if sign > 0 else builder.fsub
    return combine(into, builder.fmul(a, b, flags=_FUSED), flags=_FUSED)


def _product_into(sign: int) -> Any:
    def declare(_typing: Any, target: Any, i: Any, a: Any, j: Any, b: Any, k: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            i, j, k = (context.cast(builder, arguments[p], signature.args[p], types.int64) for p in (1, 3, 5))
            into = _pointers(context, builder, signature.args[0], arguments[0], i)
            a_re, a_im = _load(builder, _pointers(context, builder, signature.args[2], arguments[2], j))
            b_re, b_im = _load(builder, _pointers(context, builder, signature.args[4], arguments[4], k))
            x, y = _load(builder, into)
            x = _fused(builder, _fused(builder, x, sign, a_re, b_re), -sign, a_im, b_im)
            y = _fused(builder, _fused(builder, y, sign, a_re, b_im), sign, a_im, b_re)
            _store(builder, [x, y], into)
            return context.get_dummy_value()

        return types.void(target, i, a, j, b, k), generate

    return intrinsic(inspect.unwrap(declare))


add_product = _product_into(1)
"""In compiled code, add_product(target, i, a, j, b, k): target[i] += a[j] * b[k], complex, in every lane."""

subtract_product = _product_into(-1)
"""In compiled code, subtract_product(target, i, a, j, b, k): target[i] -= a[j] * b[k], complex, in every lane."""


def _subtract_dot(_typing: Any, target: Any, i: Any, a: Any, j: Any, b: Any, k: Any, length: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        i, j, k, count = (context.cast(builder, arguments[p], signature.args[p], types.int64) for p in (1, 3, 5, 6))
        zero = ir.Constant(_VECTOR, [0.0] * LANES)
        # memory that nothing else points to becomes registers
        sums = [cgutils.alloca_once_value(builder, zero) for _ in range(4)]  # type: ignore[no-untyped-call]
        with cgutils.for_range(builder, count, intp=count.type) as loop:
            row_a, row_b = builder.add(j, loop.index), builder.add(k, loop.index)
            re, im = _load(builder, _pointers(context, builder, signature.args[2], arguments[2], row_a))
            u, v = _load(builder, _pointers(context, builder, signature.args[4], arguments[4], row_b))
            for total, first, second in zip(sums, (re, im, re, im), (u, v, v, u), strict=True):
                builder.store(_fused(builder, builder.load(total), 1, first, second), total)
        re_u, im_v, re_v, im_u = (builder.load(total) for total in sums)
        into = _pointers(context, builder, signature.args[0], arguments[0], i)
        x, y = _load(builder, into)
        real, imaginary = builder.fsub(re_u, im_v), builder.fadd(re_v, im_u)
        _store(builder, [builder.fsub(x, real), builder.fsub(y, imaginary)], into)
        return context.get_dummy_value()

    return types.void(target, i, a, j, b, k, length), generate


subtract_dot = intrinsic(inspect.unwrap(_subtract_dot))
"""In compiled code, subtract_dot(target, i, a, j, b, k, length): target[i] -= the sum of a[j + m] * b[k + m]."""


def _copy_row(_typing: Any, target: Any, i: Any, a: Any, j: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        i, j = (context.cast(builder, arguments[p], signature.args[p], types.int64) for p in (1, 3))
        source = _pointers(context, builder, signature.args[2], arguments[2], j)
        _store(builder, _load(builder, source), _pointers(context, builder, signature.args[0], arguments[0], i))
        return context.get_dummy_value()

    return types.void(target, i, a, j), generate


copy_row = intrinsic(inspect.unwrap(_copy_row))
"""In compiled code, copy_row(target, i, a, j): target[i] = a[j]."""
