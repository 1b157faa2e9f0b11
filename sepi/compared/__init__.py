"""The methods that this one is compared with, each a module: its data cost, its regularisation, and its variant."""
