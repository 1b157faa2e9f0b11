// The extension module, with a submodule for each source of kernels.
#include "kernel.hpp"

#if defined(__x86_64__)
#include <cpuid.h>
#endif

// Whether processor and system support the instructions of x86-64-v3 that kernels use. Not by __builtin_cpu_supports,
// which links zig's library with its slow exp and memcpy.
static bool has_x86_64_v3() {
#if defined(__x86_64__)
    constexpr unsigned of_1 = bit_AVX | bit_FMA | bit_OSXSAVE, of_7 = bit_AVX2 | bit_BMI | bit_BMI2, both_registers = 6;
    unsigned a, b, c, d, kept, rest;
    if (!__get_cpuid(1, &a, &b, &c, &d) || (c & of_1) != of_1) return false;
    if (!__get_cpuid_count(7, 0, &a, &b, &c, &d) || (b & of_7) != of_7) return false;
    __asm__("xgetbv" : "=a"(kept), "=d"(rest) : "c"(0));
    return (kept & both_registers) == both_registers;
#else
    return false;
#endif
}

NB_MODULE(_native, m) {
    m.doc() = "Compiled loops, for one kind of processor.";
    m.attr("LANES") = sepi::LANES;
    m.attr("COMPILER") = __VERSION__;
    m.def("has_x86_64_v3", &has_x86_64_v3, "Whether this processor can use kernels that are built for x86-64-v3.");
    m.def("thread_count", &sepi::thread_count, "Threads of a loop, the caller's among them.");
    m.def("set_thread_count", &sepi::set_thread_count, nanobind::arg("count"), "Have each loop use so many threads.");
    m.def("forget_threads", &sepi::forget_threads, "Start new threads for loops, in a fork, which has none.");
    for (const auto &[name, entries] : sepi::Submodule::all()) {
        nanobind::module_ submodule = m.def_submodule(name);
        for (const auto &entry : entries) entry.add(submodule);
    }
}
