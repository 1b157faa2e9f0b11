"""Makes the report from scores, timings and stage files: tables beside the published figures, and pictures."""
