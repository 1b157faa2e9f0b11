// The extension module: a submodule for each source of kernels, by the bindings that stand beside them.
#include <nanobind/nanobind.h>

#if defined(__x86_64__)
#include <cpuid.h>
#include <immintrin.h>
#endif

#include "lanes.hpp"
#include "parallel.hpp"

namespace nb = nanobind;
using namespace nb::literals;

void bind_sweeps(nb::module_ &);
void bind_splines(nb::module_ &);
void bind_views(nb::module_ &);
void bind_boundaries(nb::module_ &);
void bind_regularization(nb::module_ &);
void bind_error_bars(nb::module_ &);
void bind_image(nb::module_ &);
void bind_inspection(nb::module_ &);
void bind_scoring(nb::module_ &);
void bind_scenes(nb::module_ &);
void bind_compared(nb::module_ &);
void bind_rendered(nb::module_ &);
void bind_applications(nb::module_ &);

#if defined(__x86_64__)
// Whether the processor has what x86-64-v3 adds to the baseline, as far as kernels use it, and the system keeps its
// registers. Not by __builtin_cpu_supports: what it needs from Clang's runtime library comes with a memcpy, an exp and
// others there, which take the place of the faster ones of the system.
__attribute__((target("xsave"))) static bool has_x86_64_v3() {
    constexpr unsigned FMA = 1u << 12, OSXSAVE = 1u << 27, AVX = 1u << 28, AVX2 = 1u << 5, BMI2 = 1u << 8, YMM = 6;
    unsigned a, b, c, d;
    const auto has = [](unsigned found, unsigned wanted) { return (found & wanted) == wanted; };
    return __get_cpuid(1, &a, &b, &c, &d) && has(c, FMA | OSXSAVE | AVX) && has(unsigned(_xgetbv(0)), YMM) &&
           __get_cpuid_count(7, 0, &a, &b, &c, &d) && has(b, AVX2 | BMI2);
}
#else
static bool has_x86_64_v3() { return false; }
#endif

NB_MODULE(_native, m) {
    m.doc() = "Compiled loops, for one kind of processor.";
    m.attr("LANES") = sepi::LANES;
    m.def("has_x86_64_v3", &has_x86_64_v3, "Whether this processor can use kernels that are built for x86-64-v3.");
    m.def("thread_count", &sepi::thread_count, "Threads of a loop, the caller's among them.");
    m.def("set_thread_count", &sepi::set_thread_count, "count"_a, "Have each loop use so many threads.");
    for (const auto bind : {bind_sweeps, bind_splines, bind_views, bind_boundaries, bind_regularization, bind_error_bars, bind_image, bind_inspection,
                            bind_scoring, bind_scenes, bind_compared, bind_rendered, bind_applications})
        bind(m);
}
