"""What these pages need beyond Sphinx and its extensions: drawings, generated pages, links that leave the folder."""
