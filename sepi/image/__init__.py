"""What is computed from one view alone: noise, edges, colours, superpixels."""
