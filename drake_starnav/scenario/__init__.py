"""What is declared: scenarios, faults, recordings, and the margins that follow from them."""
