"""A checkout's kernels are those of its sources."""

import os
import shutil
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

import sepi.kernels.checkout

CMAKE = shutil.which("cmake", path=str(Path(sys.executable).parent))
pytestmark = pytest.mark.skipif(CMAKE is None, reason="needs CMake")

RECIPE = """
cmake_minimum_required(VERSION 3.22)
project(kernels NONE)
add_custom_command(OUTPUT built DEPENDS "${CMAKE_SOURCE_DIR}/sepi/image/kernels/sums.cpp" VERBATIM
  COMMAND grep -h int "${CMAKE_SOURCE_DIR}/sepi/image/kernels/sums.cpp" > built)
add_custom_command(OUTPUT built_from DEPENDS built "${CMAKE_SOURCE_DIR}/CMakeLists.txt" VERBATIM
  COMMAND "${Python_EXECUTABLE}" "${CMAKE_SOURCE_DIR}/sepi/kernels/checkout.py" > built_from)
add_custom_target(all_of_it ALL DEPENDS built built_from)
install(FILES "${CMAKE_BINARY_DIR}/built_from" DESTINATION sepi/kernels)
"""


@pytest.mark.skipif("CXX" in os.environ or sys.platform != "linux", reason="another compiler is asked for")
def test_kernels_are_built_by_the_compiler_that_is_asked_for() -> None:
    """What builds for pip sets CXX to the compiler of Python, whose kernels compute the same, more slowly."""
    assert sepi.kernels.COMPILER.startswith("Clang")


def test_edited_sources_are_built_again(tmp_path: Path) -> None:
    source = tmp_path / "sepi/image/kernels/sums.cpp"
    kernels = tmp_path / "sepi/kernels"
    for folder in (source.parent, kernels):
        folder.mkdir(parents=True)
    module = shutil.copy(sepi.kernels.checkout.__file__, kernels)
    spec = spec_from_file_location("checkout", module)
    checkout = module_from_spec(spec)
    spec.loader.exec_module(checkout)
    assert checkout.is_current(), "an installed package has no sources to follow"
    (tmp_path / "CMakeLists.txt").write_text(RECIPE)

    for text in ("int one;\n", "int two;\n"):
        source.write_text(text)
        assert not checkout.is_current()
        checkout.build()
        assert checkout.is_current()
        assert (tmp_path / "build/kernels/built").read_text() == text

    (tmp_path / "CMakeLists.txt").write_text(f"{RECIPE}# with other flags\n")
    assert not checkout.is_current()
    checkout.build(only_if_changed=True)
    assert checkout.is_current()

    source.write_text("nothing that builds\n")
    with pytest.raises(ImportError, match="cmake"):
        checkout.build()
    assert not checkout.is_current(), "what is built is still of other sources"
