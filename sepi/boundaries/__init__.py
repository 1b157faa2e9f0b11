"""Which of two surfaces a pixel beside a depth step belongs to (:mod:`sepi.boundaries.decision`)."""
