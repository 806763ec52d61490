"""One scenario and one seed -> one trial: its outcome, its metrics and, on request, its recording."""

import drake_starnav.utils.compilation  # noqa: F401  (shows what is compiled)
