"""Benchmarks: time, memory and growth of the pipeline, its bounds, and other implementations.

``python -m bench run`` measures, ``python -m bench compare BEFORE AFTER`` compares two results. Each case runs in its
own process, with its own peak memory and nothing cached by an earlier case; times are medians. Figures of one run are
comparable; those of two runs only as ratios, since machines and loads differ.
"""
