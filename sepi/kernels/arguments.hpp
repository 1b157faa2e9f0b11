// Conversion of Python's arguments to those of kernels: arrays are used in place, never copied or converted.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/variant.h>

#include <functional>
#include <vector>

#include "array.hpp"

namespace nanobind::detail {

template <class View, class T, int N>
struct array_caster {
    using Given = ndarray<T, numpy, ndim<N>, device::cpu>;
    static constexpr bool any_strides = std::is_same_v<View, sepi::Strided<T, N>>;

    NB_TYPE_CASTER(View, make_caster<Given>::Name)

    // once for each type, not each argument, for smaller modules and faster builds
    [[gnu::noinline]] bool from_python(handle source, uint32_t flags, cleanup_list *cleanup) noexcept {
        make_caster<Given> caster;
        if (!caster.from_python(source, flags & ~uint32_t(cast_flags::convert), cleanup)) return false;
        value.data = caster.value.data();
        for (int axis = 0; axis < N; ++axis) {
            value.shape[axis] = sepi::Index(caster.value.shape(axis));
            value.strides[axis] = caster.value.stride(axis);
        }
        // NumPy's empty arrays may have strides of 0
        return any_strides || value.strides[N - 1] == 1 || value.shape[N - 1] <= 1 || caster.value.size() == 0;
    }
};

template <class T, int N>
struct type_caster<sepi::Array<T, N>> : array_caster<sepi::Array<T, N>, T, N> {};
template <class T, int N>
struct type_caster<sepi::Strided<T, N>> : array_caster<sepi::Strided<T, N>, T, N> {};

// A NamedTuple becomes a struct of the same fields in the same order, which its fields() visits.
template <class Struct>
    requires requires(Struct one) { one.fields([](auto &...) { return true; }); }
struct type_caster<Struct> {
    NB_TYPE_CASTER(Struct, const_name("tuple[typing.Any, ...]"))

    bool from_python(handle source, uint32_t flags, cleanup_list *cleanup) noexcept {
        return value.fields([&](auto &...fields) {
            Py_ssize_t n = 0;
            return PyTuple_Check(source.ptr()) && PyTuple_GET_SIZE(source.ptr()) == sizeof...(fields) &&
                   (taken(PyTuple_GET_ITEM(source.ptr(), n++), flags, cleanup, fields) && ...);
        });
    }

  private:
    template <class Field>
    [[gnu::noinline]] static bool taken(handle source, uint32_t flags, cleanup_list *cleanup, Field &field) noexcept {
        make_caster<Field> caster;
        // also for NumPy's numbers
        if (!caster.from_python(source, flags | cast_flags::convert, cleanup)) return false;
        field = caster.operator cast_t<Field>();
        return true;
    }
};

}  // namespace nanobind::detail

namespace sepi {

// What a submodule has by a name: a constant, or a kernel, which may be several for different types of arrays, and runs
// outside Python's lock.
struct Entry {
    template <class... Things>
    Entry(const char *name, Things... things) : add([=](nanobind::module_ &m) { (add_one(m, name, things), ...); }) {}

    std::function<void(nanobind::module_ &)> add;

  private:
    static void add_one(nanobind::module_ &m, const char *name, auto constant) { m.attr(name) = constant; }

    template <class Result, class... Arguments>
    static void add_one(nanobind::module_ &m, const char *name, Result (*kernel)(Arguments...)) {
        m.def(name, kernel, nanobind::call_guard<nanobind::gil_scoped_release>());
    }
};

// Submodule of a source of kernels in Python. Each source has one, filled when the extension module is loaded.
struct Submodule {
    Submodule(const char *name, std::initializer_list<Entry> entries) : name(name), entries(entries) { all().push_back(*this); }

    static std::vector<Submodule> &all() {
        static std::vector<Submodule> submodules;
        return submodules;
    }

    const char *name;
    std::vector<Entry> entries;
};

}  // namespace sepi
