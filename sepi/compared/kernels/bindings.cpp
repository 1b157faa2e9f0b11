#include "cae.hpp"
#include "kernels/arguments.hpp"
#include "message_passing.hpp"
#include "mishiba.hpp"
#include "occ.hpp"
#include "spo.hpp"
#include "weighted_median.hpp"

void bind_compared(nb::module_ &kernels) {
    auto cae = kernels.def_submodule("cae");
    cae.attr("LEVELS") = sepi::LEVELS;
    cae.attr("PATCH") = sepi::PATCH;
    cae.def("constrained_entropies", &sepi::constrained_entropies, Unlocked(), "sheared"_a, "own"_a, "weights"_a, "out"_a);
    cae.def("constrained_least_patch", &sepi::constrained_least_patch, Unlocked(), "response"_a, "guide"_a, "sigma"_a, "constraint"_a, "out"_a);

    auto message_passing = kernels.def_submodule("message_passing");
    message_passing.def("pass_messages", &sepi::pass_messages, Unlocked(), "costs"_a, "across"_a, "down"_a, "truncation"_a, "messages"_a);
    message_passing.def("decode", &sepi::decode, Unlocked(), "costs"_a, "across"_a, "down"_a, "truncation"_a, "messages"_a, "labels"_a);

    auto mishiba = kernels.def_submodule("mishiba");
    mishiba.def("pair_costs", &sepi::pair_costs, Unlocked(), "details"_a, "offsets"_a, "step"_a, "out"_a);
    mishiba.def("keep_least", &sepi::keep_least, Unlocked(), "k"_a, "slopes"_a, "constants"_a, "guide"_a, "step"_a, "labels"_a, "kept"_a);
    mishiba.def("median_pass", &sepi::median_pass, Unlocked(), "current"_a, "data"_a, "data_weights"_a, "guide"_a, "radius"_a, "gap"_a, "table"_a,
                "per_entry"_a, "out"_a);

    auto occ = kernels.def_submodule("occ");
    occ.def("moments_of_halves", &sepi::moments_of_halves, Unlocked(), "sheared"_a, "reference"_a, "places"_a, "halves"_a, "means"_a,
            "variances"_a);

    auto spo = kernels.def_submodule("spo");
    spo.def("half_distances", &sepi::half_distances, Unlocked(), "lines"_a, "shares"_a, "bins"_a, "out"_a);

    auto weighted_median = kernels.def_submodule("weighted_median");
    weighted_median.def("weighted_medians", &sepi::weighted_medians, Unlocked(), "values"_a, "guide"_a, "radius"_a, "sigma"_a, "weight"_a, "out"_a);
}
