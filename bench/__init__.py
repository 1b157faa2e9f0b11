"""Benchmarks: time, memory and growth of the pipeline, what bounds it, and other ways to compute the same.

``python -m bench run`` measures, ``python -m bench compare BEFORE AFTER`` sets two results side by side. A
case is measured in a process of its own, so that its peak memory is its own and nothing is warm from the case before;
times are medians. Machines and moments differ: figures of one run compare with each other, those of two runs as ratios.
"""
