"""Reading light fields, whatever their format (:mod:`sepi.io.readers.formats`), and writing results.

A file that is missing, damaged, of another kind or larger than its bytes can hold is a :class:`sepi.errors.SepiError`
of one line that names it (:func:`sepi.io.files.reading`); so is one that cannot be written, of which nothing is left.

Nothing is imported here: a job that reads one HDF5 file loads no reader of another format.
"""
