"""Vectors of eight float32 in compiled functions: what a kernel does with eight pixels at once, said as such.

LLVM makes vectors of plain loops by itself where it can prove that it may. It cannot where a kernel is to keep what it
knows of eight pixels in registers while it goes through many candidates. There a compiled function holds them by name::

    a = load(picture, (y, x))
    store(picture, (y, x), fma(a, a, spread(one)) / a)

Vectors are added, subtracted, multiplied and divided as numbers are, each element rounded as a number would be.
A processor whose registers are narrower does it in parts. Nothing but a compiled function can hold a vector.

Arrays are contiguous, and neither indices nor sizes are checked: an array that vectors are loaded from, or stored in,
has :data:`WIDTH` elements after the last that is asked for.
"""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.typing import templates
from numba.extending import intrinsic, lower_builtin, register_model

from sepi.compiled import fma, njit

__all__ = [
    "WIDTH", "at_most", "exp", "first_elements", "larger", "least_of", "load", "load_colours", "minus", "smaller",
    "spread", "spread_from", "store", "store_columns", "store_rounded", "sum_of", "weighted_pairs", "weights",
]  # fmt: skip

WIDTH = 8
"""Numbers in a vector: what a register of most processors holds."""

_FLAGS = ("nnan", "ninf", "nsz")
_NUMBER, _LANE = ir.FloatType(), ir.IntType(32)
_VECTOR, _LANES = ir.VectorType(_NUMBER, WIDTH), ir.VectorType(_LANE, WIDTH)

_cgutils: Any = cgutils
_templates: Any = templates
_lower: Any = lower_builtin


class Vector(types.Type):
    """Numba's type of them."""

    def __init__(self) -> None:
        super().__init__(name=f"vector of {WIDTH} float32")


class Weights(types.Type):
    """Numba's type of :func:`weights`."""

    def __init__(self) -> None:
        super().__init__(name=f"vector of {WIDTH} pairs of int16")


VECTOR, WEIGHTS = Vector(), Weights()


@register_model(Vector)
class _VectorModel(models.PrimitiveModel):  # type: ignore[misc, unused-ignore]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)  # type: ignore[no-untyped-call, unused-ignore]


@register_model(Weights)
class _WeightsModel(models.PrimitiveModel):  # type: ignore[misc, unused-ignore]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _LANES)  # type: ignore[no-untyped-call, unused-ignore]


def _define(function: Any, instruction: str) -> None:
    """Have an operator of two vectors be one instruction."""

    @_templates.infer_global(function)
    class _Typing(_templates.ConcreteTemplate):  # type: ignore[misc, unused-ignore]
        cases = (_templates.signature(VECTOR, VECTOR, VECTOR),)

    @_lower(function, VECTOR, VECTOR)  # type: ignore[untyped-decorator, unused-ignore]
    def _code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return getattr(builder, instruction)(*arguments, flags=_FLAGS)


for _operator, _instruction in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _define(_operator, _instruction)


def _all_alike(builder: Any, value: Any, kind: Any) -> Any:
    one = builder.insert_element(ir.Constant(kind, ir.Undefined), value, _LANE(0))
    return builder.shuffle_vector(one, one, ir.Constant(_LANES, [_LANE(0)] * WIDTH))


def _place(context: Any, builder: Any, of: Any, values: Any) -> Any:
    """Address of an element; ``of`` and ``values`` begin with the array and the index, a number or a tuple."""
    array = context.make_array(of[0])(context, builder, values[0])
    parts, kinds = [values[1]], [of[1]]
    if isinstance(of[1], types.BaseTuple):
        parts, kinds = _cgutils.unpack_tuple(builder, values[1], len(of[1])), [*of[1]]  # type: ignore[misc, unused-ignore]
    indices = [context.cast(builder, part, kind, types.intp) for part, kind in zip(parts, kinds, strict=True)]
    return _cgutils.get_item_pointer(context, builder, of[0], array, indices, wraparound=False)


def _load(_context: Any, array: Any, index: Any) -> Any:
    """LLVM code of :func:`load`."""

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        place = _place(context, builder, given.args, arguments)
        kind = ir.VectorType(place.type.pointee, WIDTH)
        values = builder.load(builder.bitcast(place, kind.as_pointer()), align=array.dtype.bitwidth // 8)
        return values if kind.element == _NUMBER else builder.uitofp(values, _VECTOR)

    return VECTOR(array, index), code


def _store(_context: Any, array: Any, index: Any, _vector: Any) -> Any:
    """LLVM code of :func:`store`."""

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        place = _place(context, builder, given.args, arguments)
        builder.store(arguments[2], builder.bitcast(place, _VECTOR.as_pointer()), align=4)
        return context.get_dummy_value()

    return types.void(array, index, VECTOR), code


def _spread(_context: Any, _number: Any) -> Any:
    """LLVM code of :func:`spread`."""

    def code(_context: Any, builder: Any, _given: Any, arguments: Any) -> Any:
        return _all_alike(builder, arguments[0], _VECTOR)

    return VECTOR(types.float32), code


def _spread_from(_context: Any, array: Any, index: Any) -> Any:
    """LLVM code of :func:`spread_from`."""

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        return _all_alike(builder, builder.load(_place(context, builder, given.args, arguments)), _VECTOR)

    return VECTOR(array, index), code


def _first_elements(_context: Any, _vector: Any, number: Any, _others: Any) -> Any:
    """LLVM code of :func:`first_elements`."""

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        vector, number, others = arguments
        number = _all_alike(builder, context.cast(builder, number, given.args[1], types.int32), _LANES)
        within = builder.icmp_signed("<", ir.Constant(_LANES, [_LANE(i) for i in range(WIDTH)]), number)
        return builder.select(within, vector, _all_alike(builder, others, _VECTOR))

    return VECTOR(VECTOR, number, types.float32), code


def _reduced(combine: Any) -> Any:
    """LLVM code of what makes one number of a vector: halves are combined until one is left."""

    def typed(_context: Any, _vector: Any) -> Any:
        def code(_context: Any, builder: Any, _given: Any, arguments: Any) -> Any:
            found, width = arguments[0], WIDTH
            while width > 1:
                width //= 2
                lanes = ir.VectorType(_LANE, width)
                halves = (ir.Constant(lanes, [_LANE(i + first) for i in range(width)]) for first in (0, width))
                found = combine(builder, *(builder.shuffle_vector(found, found, half) for half in halves))
            return builder.extract_element(found, _LANE(0))

        return types.float32(VECTOR), code

    return intrinsic(typed)


def _lesser(builder: Any, a: Any, b: Any, greater: bool = False) -> Any:
    return builder.select(builder.fcmp_ordered(">" if greater else "<", a, b, flags=_FLAGS), a, b)


def _smaller(_context: Any, _a: Any, _b: Any) -> Any:
    """LLVM code of :func:`smaller`."""

    def code(_context: Any, builder: Any, _given: Any, arguments: Any) -> Any:
        return _lesser(builder, *arguments)

    return VECTOR(VECTOR, VECTOR), code


def _larger(_context: Any, _a: Any, _b: Any) -> Any:
    """LLVM code of :func:`larger`."""

    def code(_context: Any, builder: Any, _given: Any, arguments: Any) -> Any:
        return _lesser(builder, arguments[0], arguments[1], greater=True)

    return VECTOR(VECTOR, VECTOR), code


def _store_columns(_context: Any, array: Any, index: Any, vectors: Any) -> Any:
    """LLVM code of :func:`store_columns`."""

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        rows = _cgutils.unpack_tuple(builder, arguments[2], WIDTH)
        for step in (1, 2, 4):
            # of each pair of rows, one takes what has the step's bit in its number from the other, and the reverse
            first = [i + (WIDTH - step if i & step else 0) for i in range(WIDTH)]
            masks = (ir.Constant(_LANES, [_LANE(i + more) for i in first]) for more in (0, step))
            low, high = masks
            for i in (i for i in range(WIDTH) if not i & step):
                a, b = rows[i], rows[i + step]
                rows[i], rows[i + step] = builder.shuffle_vector(a, b, low), builder.shuffle_vector(a, b, high)
        row, column = _cgutils.unpack_tuple(builder, arguments[1], 2)
        for i, vector in enumerate(rows):
            place = context.make_tuple(builder, index, (builder.add(row, row.type(i)), column))
            builder.store(
                vector,
                builder.bitcast(_place(context, builder, given.args, (arguments[0], place)), _VECTOR.as_pointer()),
                align=4,
            )
        return context.get_dummy_value()

    return types.void(array, index, vectors), code


def _at_most(_context: Any, _a: Any, _b: Any, _yes: Any, _no: Any) -> Any:
    """LLVM code of :func:`at_most`."""

    def code(_context: Any, builder: Any, _given: Any, arguments: Any) -> Any:
        a, b, yes, no = arguments
        return builder.select(builder.fcmp_ordered("<=", a, b), yes, no)

    return VECTOR(VECTOR, VECTOR, VECTOR, VECTOR), code


def _load_colours(_context: Any, array: Any, index: Any) -> Any:
    """LLVM code of :func:`load_colours`."""

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        place = _place(context, builder, given.args, arguments)
        kind = ir.VectorType(place.type.pointee, WIDTH)
        if array.layout == "C":
            whole = ir.VectorType(place.type.pointee, 3 * WIDTH)
            pixels = builder.load(builder.bitcast(place, whole.as_pointer()), align=array.dtype.bitwidth // 8)
            taken = (ir.Constant(_LANES, [_LANE(3 * i + c) for i in range(WIDTH)]) for c in range(3))
            channels = [builder.shuffle_vector(pixels, pixels, one) for one in taken]
        else:
            # grey, seen as three equal channels: these are the same in memory
            channels = [ir.Constant(kind, ir.Undefined)] * 3
            parts = _cgutils.unpack_tuple(builder, arguments[1], len(index))
            for i, c in np.ndindex(WIDTH, 3):
                moved = [
                    *parts[:-2],
                    builder.add(parts[-2], parts[-2].type(i)),
                    builder.add(parts[-1], parts[-1].type(c)),
                ]
                one = _place(context, builder, given.args, (arguments[0], context.make_tuple(builder, index, moved)))
                channels[c] = builder.insert_element(channels[c], builder.load(one), _LANE(i))
        numbers = [channel if kind.element == _NUMBER else builder.uitofp(channel, _VECTOR) for channel in channels]
        return context.make_tuple(builder, given.return_type, numbers)

    return types.UniTuple(VECTOR, 3)(array, index), code  # type: ignore[no-untyped-call, unused-ignore]


def _store_rounded(_context: Any, array: Any, index: Any, _vector: Any) -> Any:
    """LLVM code of :func:`store_rounded`."""

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        place = builder.bitcast(_place(context, builder, given.args, arguments), _LANES.as_pointer())
        builder.store(builder.fptosi(_call(builder, "llvm.nearbyint", arguments[2]), _LANES), place, align=4)
        return context.get_dummy_value()

    return types.void(array, index, VECTOR), code


def _call(builder: Any, name: str, argument: Any) -> Any:
    """An intrinsic of LLVM, of one vector."""
    function = ir.FunctionType(_VECTOR, [_VECTOR])
    return builder.call(_cgutils.get_or_insert_function(builder.module, function, f"{name}.v{WIDTH}f32"), [argument])


def _rounded(_context: Any, _vector: Any) -> Any:
    """LLVM code of :func:`_whole`."""

    def code(_context: Any, builder: Any, _given: Any, arguments: Any) -> Any:
        return _call(builder, "llvm.nearbyint", arguments[0])

    return VECTOR(VECTOR), code


def _power_of_two(_context: Any, _vector: Any) -> Any:
    """LLVM code of :func:`_two_to`."""

    def code(_context: Any, builder: Any, _given: Any, arguments: Any) -> Any:
        lowest = ir.Constant(_VECTOR, [_NUMBER(-126.0)] * WIDTH)
        exponent = builder.fptosi(_lesser(builder, lowest, arguments[0], greater=True), _LANES)
        bits = builder.shl(
            builder.add(exponent, ir.Constant(_LANES, [_LANE(127)] * WIDTH)), ir.Constant(_LANES, [_LANE(23)] * WIDTH)
        )
        return builder.bitcast(bits, _VECTOR)

    return VECTOR(VECTOR), code


def _weights(_context: Any, _first: Any, _second: Any) -> Any:
    """LLVM code of :func:`weights`."""

    def code(_context: Any, builder: Any, _given: Any, arguments: Any) -> Any:
        low = builder.and_(builder.trunc(arguments[0], _LANE), _LANE(0xFFFF))
        return _all_alike(builder, builder.or_(low, builder.shl(builder.trunc(arguments[1], _LANE), _LANE(16))), _LANES)

    return WEIGHTS(types.int64, types.int64), code


def _weighted_pairs(_context: Any, array: Any, above: Any, below: Any, _upper: Any, _lower: Any) -> Any:
    """LLVM code of :func:`weighted_pairs`."""

    def products(builder: Any, pairs: Any, weights: Any) -> Any:
        # in the order in which LLVM finds the one instruction that most processors have for it
        short, long = (ir.VectorType(ir.IntType(bits), 2 * WIDTH) for bits in (16, 32))
        factors = (builder.sext(builder.bitcast(vector, short), long) for vector in (pairs, weights))
        whole = builder.mul(*factors, flags=("nsw",))
        of_either = (ir.Constant(_LANES, [_LANE(2 * i + first) for i in range(WIDTH)]) for first in (0, 1))
        return builder.add(*(builder.shuffle_vector(whole, whole, taken) for taken in of_either))

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        sums = []
        for n in (1, 2):
            place = _place(context, builder, (given.args[0], given.args[n]), (arguments[0], arguments[n]))
            pairs = builder.load(builder.bitcast(place, _LANES.as_pointer()), align=4)
            sums.append(products(builder, pairs, arguments[n + 2]))
        return builder.sitofp(builder.add(*sums), _VECTOR)

    return VECTOR(array, above, below, WEIGHTS, WEIGHTS), code


def _minus(_context: Any, _vector: Any) -> Any:
    """LLVM code of :func:`minus`."""

    def code(_context: Any, builder: Any, _given: Any, arguments: Any) -> Any:
        return builder.fneg(arguments[0])

    return VECTOR(VECTOR), code


load: Any = intrinsic(_load)
"""``load(array, index)``: the elements from an index on, of float32, or of unsigned integers made float32."""

store: Any = intrinsic(_store)
"""``store(array, index, vector)``: keep a vector in an array of float32, from an index on."""

load_colours: Any = intrinsic(_load_colours)
"""``load_colours(array, index)``: vectors of the three channels from a pixel's first on, as float32.

Pixels ``(..., x, c)``, whose channels lie side by side, or of grey views, which are in memory once. Nothing beyond the
eighth is read."""

store_rounded: Any = intrinsic(_store_rounded)
"""``store_rounded(array, index, vector)``: keep a vector, rounded, in an array of int32, from an index on."""

weights: Any = intrinsic(_weights)
"""``weights(first, second)``: two whole numbers of 16 bits, for :func:`weighted_pairs`."""

weighted_pairs: Any = intrinsic(_weighted_pairs)
"""``weighted_pairs(array, above, below, upper, lower)``: weighted sums of neighbours in two rows of integers.

Elements of the array, int32, are pairs of 16-bit numbers: one, and its neighbour in the upper half. From either index
on both are multiplied with the weights of that row, and all four are added, as float32.
"""

spread: Any = intrinsic(_spread)
"""``spread(number)``: a vector of the same float32 throughout."""

spread_from: Any = intrinsic(_spread_from)
"""``spread_from(array, index)``: an element of an array of float32 throughout."""

first_elements: Any = intrinsic(_first_elements)
"""``first_elements(vector, number, others)``: so many of them, and after those a float32 instead."""

sum_of: Any = _reduced(lambda builder, a, b: builder.fadd(a, b, flags=_FLAGS))
"""``sum_of(vector)``: of its elements, halves first."""

least_of: Any = _reduced(_lesser)
"""``least_of(vector)``: of its elements."""

smaller: Any = intrinsic(_smaller)
"""``smaller(a, b)``: of each two elements."""

larger: Any = intrinsic(_larger)
"""``larger(a, b)``: of each two elements."""

store_columns: Any = intrinsic(_store_columns)
"""``store_columns(array, index, vectors)``: eight vectors as columns of an array ``(y, x)``, from an index on."""

minus: Any = intrinsic(_minus)
"""``minus(vector)``: the negative of each element."""

at_most: Any = intrinsic(_at_most)
"""``at_most(a, b, yes, no)``: elements of ``yes`` where ``a <= b``, those of ``no`` elsewhere."""

_whole: Any = intrinsic(_rounded)
_two_to: Any = intrinsic(_power_of_two)


@njit(inline="always")
def exp(x: Any) -> Any:
    """``exp`` of each element of a vector, of numbers up to 0; within some roundings, and next to nothing below -87."""
    n = _whole(x * spread(np.float32(1.44269504)))
    # the logarithm of two in two parts: products of the first with n are exact
    f = fma(n, spread(np.float32(-1.42860682e-6)), fma(n, spread(np.float32(-0.693145752)), x))
    p = fma(f, spread(np.float32(1 / 720)), spread(np.float32(1 / 120)))
    p = fma(f, fma(f, fma(f, p, spread(np.float32(1 / 24))), spread(np.float32(1 / 6))), spread(np.float32(0.5)))
    return fma(f, fma(f, p, spread(np.float32(1))), spread(np.float32(1))) * _two_to(n)
