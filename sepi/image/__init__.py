"""Computations on one view: noise, edges, mean shift, superpixels."""
