"""Networks with one hidden layer: training, output stage of a model, training of PyTorch modules."""
