// The renderer of the next commits.
