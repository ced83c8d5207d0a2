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


def _product_into(sign: int) -> Any:
    def declare(_typing: Any, target: Any, i: Any, a: Any, j: Any, b: Any, k: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            def parts(position: int) -> list[Any]:
                array_type, index_type = signature.args[position : position + 2]
                data = context.make_array(array_type)(context, builder, arguments[position]).data
                index = context.cast(builder, arguments[position + 1], index_type, types.int64)
                vectors = builder.bitcast(data, _VECTOR.as_pointer())
                real = builder.shl(index, ir.Constant(index.type, 1))
                imaginary = builder.add(real, ir.Constant(index.type, 1))
                return [builder.gep(vectors, [real]), builder.gep(vectors, [imaginary])]

            def load(pointers: list[Any]) -> list[Any]:
                return [builder.load(pointer, align=8) for pointer in pointers]

            into = parts(0)
            (x, y), (a_re, a_im), (b_re, b_im) = load(into), load(parts(2)), load(parts(4))
            plus, minus = (builder.fadd, builder.fsub) if sign > 0 else (builder.fsub, builder.fadd)
            x = plus(x, builder.fmul(a_re, b_re, flags=_FUSED), flags=_FUSED)
            x = minus(x, builder.fmul(a_im, b_im, flags=_FUSED), flags=_FUSED)
            y = plus(y, builder.fmul(a_re, b_im, flags=_FUSED), flags=_FUSED)
            y = plus(y, builder.fmul(a_im, b_re, flags=_FUSED), flags=_FUSED)
            for value, pointer in zip((x, y), into, strict=True):
                builder.store(value, pointer, align=8)
            return context.get_dummy_value()

        return types.void(target, i, a, j, b, k), generate

    return intrinsic(inspect.unwrap(declare))


add_product = _product_into(1)
"""In compiled code, add_product(target, i, a, j, b, k): target[i] += a[j] * b[k], complex, in every lane."""

subtract_product = _product_into(-1)
"""In compiled code, subtract_product(target, i, a, j, b, k): target[i] -= a[j] * b[k], complex, in every lane."""
