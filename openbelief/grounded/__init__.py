"""The readout `grounded` and what belongs to it: ours, beside the paper's three. All is computed at read time."""
