"""Probes: SEPIs and cost curves of single pixels."""
