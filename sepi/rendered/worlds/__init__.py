"""A module for each path-traced scene, whose function ``world`` makes it; :mod:`sepi.rendered.catalogue` lists them."""
