"""A module for each path-traced scene, whose function ``world`` makes it; the catalogue lists them."""
