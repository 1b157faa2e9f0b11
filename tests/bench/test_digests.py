"""The comparison of maps on other numbers of threads."""

from error_lines import done

from bench.__main__ import main

# of one texture: each process draws it
SMALL = ["digests", "--scene", "slanted_plane", "--size", "64", "--views", "3"]
SMALL += ["--variant", "no_occlusion_no_textureless"]


def test_one_digest_on_more_threads_than_cores_and_on_any_processor() -> None:
    """Sums that depend on who computes what, or on its registers, would make a map that nobody can reproduce."""
    result = done(*SMALL, "--threads", "1", "--threads", "3", of=main)
    heading, *_, row = result.output.strip().splitlines()
    assert heading.endswith(": 1 thread; 3 threads; 3 threads, for any processor")
    assert row.strip("| ").endswith("none")
