"""Support for the Snakemake workflow: configuration, datasets, digests of the code, its log."""
