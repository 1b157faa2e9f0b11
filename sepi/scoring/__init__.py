"""Scores: masks of regions, measures, and the submission format of the HCI 4D benchmark."""
