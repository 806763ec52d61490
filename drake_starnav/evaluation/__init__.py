"""Run many trials through an executor, store them in a file, summarise them."""
