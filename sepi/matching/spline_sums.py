"""A sample of a cubic spline of four channels, as compiled functions make it.

It is a sum of 4x4 coefficients. The channels of a coefficient lie side by side, so that a row of four coefficients is
one vector of sixteen numbers: here it is written down as such, since the compiler does not find it. Coefficients and
weights are whole numbers of 16 bits, of which processors multiply twice as many at once as of float32; what the
rounding of the sums of columns leaves is a tenth of the steps of an 8-bit picture.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

_cgutils: Any = cgutils
_FOUR: Any = types.UniTuple(types.float32, 4)  # type: ignore[no-untyped-call]

_LANE, _NUMBER = ir.IntType(32), ir.FloatType()
_EIGHT, _SIXTEEN, _SHORT = ir.VectorType(_LANE, 8), ir.VectorType(_LANE, 16), ir.VectorType(ir.IntType(16), 16)


def _each(builder: Any, vector: Any, numbers: list[int], other: Any = None) -> Any:
    """Elements of a vector, or of two, by their numbers."""
    mask = ir.Constant(ir.VectorType(_LANE, len(numbers)), [_LANE(n) for n in numbers])
    return builder.shuffle_vector(vector, vector if other is None else other, mask)


def _alike(builder: Any, value: Any, kind: Any) -> Any:
    """A vector of the same number throughout."""
    one = builder.insert_element(ir.Constant(kind, ir.Undefined), value, _LANE(0))
    return _each(builder, one, [0] * kind.count)


def _products(builder: Any, a: Any, b: Any) -> Any:
    """Of 16-bit numbers, with 32 bits."""
    return builder.mul(*(builder.sext(builder.bitcast(vector, _SHORT), _SIXTEEN) for vector in (a, b)), flags=("nsw",))


def _rounded_products(context: Any, builder: Any, a: Any, b: Any) -> Any:
    """Of 16-bit numbers, by 2^15, rounded."""
    if "+avx2" in context.codegen()._tm_features:
        # one instruction, which LLVM does not find
        kind, name = ir.FunctionType(_SHORT, [_SHORT, _SHORT]), "llvm.x86.avx2.pmul.hr.sw"
        function = _cgutils.get_or_insert_function(builder.module, kind, name)
        return builder.call(function, [builder.bitcast(vector, _SHORT) for vector in (a, b)])
    twice = builder.ashr(_products(builder, a, b), ir.Constant(_SIXTEEN, [_LANE(14)] * 16))
    one = ir.Constant(_SIXTEEN, [_LANE(1)] * 16)
    return builder.trunc(builder.ashr(builder.add(twice, one), one), _SHORT)


def _code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """LLVM code of :func:`weighted_sum`."""
    splines, start, stride, weights, first, pitch, unit = arguments
    data, lines = (
        context.make_array(signature.args[n])(context, builder, array).data for n, array in ((0, splines), (3, weights))
    )

    def of_line(i: int) -> Any:
        """The pair of weights of line ``i``, throughout."""
        place = builder.add(first, builder.mul(pitch, pitch.type(i)))
        return _alike(builder, builder.load(builder.gep(lines, [place])), _EIGHT)

    def row(i: int) -> Any:
        place = builder.gep(data, [builder.add(start, builder.mul(stride, stride.type(i)))])
        return builder.load(builder.bitcast(place, _SHORT.as_pointer()), align=2)

    total = _rounded_products(context, builder, row(0), of_line(0))
    for i in range(1, 4):
        total = builder.add(total, _rounded_products(context, builder, row(i), of_line(i)))
    # neighbours of one channel side by side
    total = _each(builder, total, [8 * (i // 8) + 4 * (i % 2) + i % 8 // 2 for i in range(16)])
    across = _each(builder, of_line(4), [8 * (i // 4) for i in range(8)], of_line(5))
    whole = _products(builder, total, across)
    sums = builder.add(*(_each(builder, whole, list(range(i, 16, 2))) for i in (0, 1)))
    sums = builder.add(_each(builder, sums, [0, 1, 2, 3]), _each(builder, sums, [4, 5, 6, 7]))
    four = ir.VectorType(_NUMBER, 4)
    values = builder.fmul(builder.sitofp(sums, four), _alike(builder, unit, four))
    return context.make_tuple(
        builder, signature.return_type, [builder.extract_element(values, _LANE(i)) for i in range(4)]
    )


def _typed(
    _context: Any, splines: Any, start: Any, stride: Any, weights: Any, first: Any, pitch: Any, unit: Any
) -> Any:
    whole = types.int64
    return _FOUR(splines, whole, whole, weights, whole, whole, types.float32), _code


weighted_sum: Any = intrinsic(_typed)
"""``weighted_sum(c, start, stride, w, first, pitch, unit)``: four samples, of a spline of four channels.

``unit sum_ij a[i] b[j] c[start + i stride + 4 j]`` over an array ``c`` of int16, and the same of the three elements
after; float32. The weights, of sum 2^15, are in an array of int32, from ``first`` on and ``pitch`` apart, as pairs of
16-bit numbers: of the four rows each twice, of the columns the first two and the others.
"""
