"""Reading light fields of any format (:mod:`sepi.io.readers.formats`), and writing results.

A file that is missing, damaged, of another kind, or that claims more data than its bytes can hold raises a
:class:`sepi.errors.SepiError` of one line that names it (:func:`sepi.io.files.reading`). So does a file that cannot be
written; no part of it stays.

This module imports nothing, so a job that reads one HDF5 file loads no reader of another format.
"""
