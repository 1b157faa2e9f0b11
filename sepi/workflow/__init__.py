"""What the Snakemake workflow needs: configuration, datasets, digests of the code, its log."""
