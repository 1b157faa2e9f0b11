"""Reading light fields, whatever their format (:mod:`sepi.io.readers.formats`), and writing results.

Nothing is imported here: a job that reads one HDF5 file loads no reader of another format.
"""
