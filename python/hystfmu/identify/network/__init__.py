"""Networks with one hidden layer as the output stage of a model, and their training."""
