#include "kernels/arguments.hpp"
#include "rendering.hpp"

void bind_scenes(nb::module_ &kernels) {
    auto rendering = kernels.def_submodule("rendering");
    rendering.attr("BEYOND") = sepi::BEYOND;
    rendering.def("nearest", &sepi::nearest, Unlocked(), "drawing"_a, "disparity"_a, "owner"_a);
    rendering.def("shade", &sepi::shade, Unlocked(), "drawing"_a, "v"_a, "u"_a, "samples"_a, "picture"_a);
    rendering.def("hide", &sepi::hide, Unlocked(), "drawing"_a, "boxes"_a, "disparity"_a, "v"_a, "u"_a, "hidden"_a);
    rendering.def("cast", &sepi::cast, Unlocked(), "drawing"_a, "boxes"_a, "normals"_a, "origin"_a, "rays"_a, "pinhole"_a, "depth"_a, "colours"_a);
}
