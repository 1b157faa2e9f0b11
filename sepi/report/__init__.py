"""From scores, timings and stage files to what a reader looks at: tables beside the published figures, and pictures."""
