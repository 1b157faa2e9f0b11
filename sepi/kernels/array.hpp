// Views of arrays, and scratch memory, for kernels; independent of Python.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

namespace sepi {

using Index = std::ptrdiff_t;

// Non-owning view of a strided array, as NumPy has them. Builds without NDEBUG check the indices of elements.
template <class T, int N>
struct Array {
    T *data;
    std::array<Index, N> shape;
    std::array<Index, N> strides;  // in elements

    // Address of an element, or of the first element of the remaining axes if there are fewer indices than axes.
    template <class... Indices>
    T *at(Indices... indices) const {
        static_assert(sizeof...(Indices) <= N);
        T *place = data;
        int axis = 0;
        ((place += Index(indices) * strides[axis++]), ...);
        return place;
    }

    template <class... Indices>
    T &operator()(Indices... indices) const {
        static_assert(sizeof...(Indices) == N);
        int axis = 0;
        (check(Index(indices), axis++), ...);
        return *at(indices...);
    }

    Array<T, N - 1> operator[](Index i) const {
        static_assert(N > 1);
        check(i, 0);
        Array<T, N - 1> part{at(i), {}, {}};
        std::copy(shape.begin() + 1, shape.end(), part.shape.begin());
        std::copy(strides.begin() + 1, strides.end(), part.strides.begin());
        return part;
    }

    // A writable array converts to a read-only one.
    operator Array<const T, N>() const
        requires(!std::is_const_v<T>)
    {
        return {data, shape, strides};
    }

  private:
    void check([[maybe_unused]] Index i, [[maybe_unused]] int axis) const {
#ifndef NDEBUG
        if (i < 0 || i >= shape[axis]) throw std::out_of_range("index " + std::to_string(i) + " of an axis of " + std::to_string(shape[axis]));
#endif
    }
};

// An array with any stride along its last axis; elements of Array are contiguous there.
template <class T, int N>
struct Strided : Array<T, N> {};

constexpr float INFINITE = std::numeric_limits<float>::infinity();

constexpr std::align_val_t ALIGNED{64};  // to lines of the cache

// Uninitialised memory of a C-contiguous array, freed with its owner.
template <class T, int N>
class Scratch {
  public:
    template <class... Sizes>
    explicit Scratch(Sizes... sizes) : size_((Index(sizes) * ...)), memory_(new (ALIGNED) T[size_]), array_{memory_.get(), {Index(sizes)...}, {}} {
        static_assert(sizeof...(Sizes) == N);
        Index stride = 1;
        for (int axis = N - 1; axis >= 0; --axis) {
            array_.strides[axis] = stride;
            stride *= array_.shape[axis];
        }
    }

    Scratch &&filled(T value) && {
        std::fill_n(memory_.get(), size_, value);
        return std::move(*this);
    }

    const Array<T, N> &array() const { return array_; }

  private:
    struct Free {
        void operator()(T *memory) const { operator delete[](memory, ALIGNED); }
    };
    Index size_;
    std::unique_ptr<T[], Free> memory_;
    Array<T, N> array_;
};

template <class T, int N, class... Sizes>
Scratch<T, N> zeros(Sizes... sizes) {
    return Scratch<T, N>(sizes...).filled(T(0));
}

}  // namespace sepi
