"""The report: tables beside the published figures, charts, pictures and the page."""
