"""Readers of light fields, one module per format; the registry is :mod:`sepi.io.readers.formats`."""
