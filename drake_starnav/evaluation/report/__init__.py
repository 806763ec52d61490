"""Reports on many trials: tables, plots, trajectories and recordings, on a page that opens offline."""
