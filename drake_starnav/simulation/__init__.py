"""One scenario and one seed -> one trial: its outcome, its metrics and, on request, its recording."""
