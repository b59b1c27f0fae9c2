"""Networks with one hidden layer as readout: training, restarts, PyTorch modules, sweeps over the hidden size."""
