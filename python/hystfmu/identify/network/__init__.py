"""Networks with one hidden layer as a readout: training, restarts, PyTorch modules, sweeps over the hidden size."""
